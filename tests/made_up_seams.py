"""Seams that are worked out slowly: every labelling of a small grid, every edge by itself."""

from itertools import product

import numpy as np

from dav_gswt.tiles import energy


def cheapest(right, upper, first, second):
    """Slow twin of cuts.cut: every labelling of the free cells."""
    free = np.argwhere(~(first | second))
    best = np.inf
    for bits in product([False, True], repeat=len(free)):
        labels = second.copy()
        labels[tuple(free.T)] = bits
        cost = right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum()
        best = min(best, cost)
    return best


def cost(terms, labels, rows, columns):
    """Slow twin of an expansion's energy: edge by edge, Eq. (graphcut_main) written out. rows, columns: by label."""
    total, (h, w) = 0.0, labels.shape
    for y, x in product(range(h), range(w)):
        for axis, (v, u) in enumerate([(y, x + 1), (y + 1, x)]):
            if v == h or u == w or labels[y, x] == labels[v, u]:
                continue
            above = below = 0.0
            for share, layer in terms:
                for p in ((y, x), (v, u)):
                    a, b = ((rows[k][[p[0]], [p[1]]], columns[k][[p[0]], [p[1]]]) for k in (labels[y, x], labels[v, u]))
                    above += share * layer.apart(a, b)[0] / layer.unit.difference
                    below += share * (layer.slope[a][0, axis] + layer.slope[b][0, axis]) / layer.unit.gradient
            total += above / (below + energy.EPS)
    return total


def halves(step=0.0):
    """A crop of two halves, as `crops.Shown` holds it: patch 0 to the west, patch 1 to the east, both one texture."""
    rng = np.random.default_rng(4)
    texture = np.clip(0.5 + 0.1 * rng.normal(size=(48, 48, 3)), 0, 1).astype(np.float32)
    patch = (np.arange(48) >= 24)[None].repeat(48, 0).astype(int)
    picture = texture.copy()
    picture[:, 24:] += np.float32(step)
    return texture, np.clip(picture, 0, 1), patch
