"""Poisson blending: spread out the steps of brightness and height that the best cuts leave across seams.

Every tile gets a correction c per cell, smooth except at the seams, where it jumps against the step between the two
patches: it minimises sum over neighbours s, t of |c_t - c_s + J_st|^2 (Poisson fusion with the step as its source).
J_st is 0 inside a patch and on a seam the soft difference of the patches: for colour limited, so that a shrub cut in
two does not bleed over the sand; for height whole, since a step left in the ground is a visible gap. A
strip's correction belongs to its colour and is 0 in the corner patch, and a tile's takes the strips' values along its
border: neighbours still match. All levels take the same correction.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray as Array
from scipy.fft import dct, dst, idct, idst
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles.layout import Layout, edge_colours, strip_labels
from dav_gswt.tiles.search import SearchResult

BLUR = (2.0, 2.0, 2.0, 0.5)  # cells: grain is not a step; a surface is smooth already


@dataclass(frozen=True)
class SoftMaps:
    """Soft colour and height of the exemplar's cells, and how large a step of colour may be before it counts less."""

    values: Float[Array, "m m 4"]
    limit: float


def make_soft_maps(colour: Float[Array, "m m 3"], height: Float[Array, "m m"]) -> SoftMaps:
    """The limit is the exemplar's own standard deviation, one for all colour channels."""
    values = np.concatenate([colour, height[..., None]], -1)
    soft = np.stack([gaussian_filter(values[..., c], BLUR[c], mode="nearest") for c in range(4)], -1)
    return SoftMaps(soft, float(colour.std((0, 1)).mean()))


def sum_steps(labels: UInt8[Array, "h w"], shift: Int[Array, "k 2"], ground: SoftMaps) -> Float[Array, "h w 4"]:
    """Sum over a cell's neighbours t of J_st, the step from its own patch to theirs.

    shift[label] is what to add to a cell (x, y) for the exemplar's cell. J = d for height and d / (1 + |d / limit|^2)
    for colour, with d the mean over both cells of the patches' difference: what lies beyond the limit is an object's
    edge, not a step of brightness.
    """
    total = np.zeros((*labels.shape, 4))
    last = np.array(ground.values.shape[:2]) - 1
    for dy, dx in ((0, 1), (1, 0)):
        h, w = labels.shape[0] - dy, labels.shape[1] - dx
        a, b = labels[:h, :w], labels[dy:, dx:]
        y, x = np.nonzero(a != b)
        own, other = shift[a[y, x]], shift[b[y, x]]
        d = np.zeros((len(y), 4))
        for sy, sx in ((y, x), (y + dy, x + dx)):
            there, here = (tuple(np.clip([sy + m[:, 1], sx + m[:, 0]], 0, last[:, None])) for m in (other, own))
            d += 0.5 * (ground.values[there] - ground.values[here])
        relative = d[:, :3] / (ground.limit or 1.0)
        d[:, :3] /= 1 + (relative**2).mean(1, keepdims=True)
        np.add.at(total, (y, x), d)
        np.add.at(total, (y + dy, x + dx), -d)
    return total


def solve_corrections(
    plan: Layout, found: SearchResult, shifts: Int[Array, "t 9 2"], ground: SoftMaps
) -> Float[Array, "t n n 4"]:
    """Correction of every tile's cells, so that no step is left along its seams; strips are solved first.

    shifts: of each tile's labels (`layout.label_shifts`).
    """
    places = found.places
    directions = (True, found.vertical, places.vertical), (False, found.horizontal, places.horizontal)
    vertical, horizontal = (
        np.stack(
            [
                solve_strip(*strip_labels(plan, mask, place, places.corner, upright), plan, ground)
                for mask, place in zip(masks, patches, strict=True)
            ]
        )
        for upright, masks, patches in directions
    )
    return np.stack(
        [
            solve_tile(labels, shift, border_values(plan, vertical, horizontal, tile), plan, ground)
            for tile, (labels, shift) in enumerate(zip(found.labels, shifts, strict=True))
        ]
    )


def solve_strip(
    labels: UInt8[Array, "h w"], shift: Int[Array, "k 2"], plan: Layout, ground: SoftMaps
) -> Float[Array, "h w 4"]:
    """Correction of a strip along its longer side: 0 in the corners' forced ends, free at the long sides."""
    upright = labels.shape[0] > labels.shape[1]
    source = -sum_steps(labels, shift, ground)
    source = source if upright else source.swapaxes(0, 1)
    out, ends = np.zeros_like(source), slice(plan.strip, len(source) - plan.strip)
    rows, columns = source[ends].shape[:2]
    spectrum = dct(dst(source[ends], type=1, axis=0), type=2, axis=1)
    spectrum /= -(_fixed(rows)[:, None] + _free(columns)[None])[..., None]
    out[ends] = idst(idct(spectrum, type=2, axis=1), type=1, axis=0)
    return out if upright else out.swapaxes(0, 1)


def solve_tile(
    labels: UInt8[Array, "n n"], shift: Int[Array, "9 2"], ring: Float[Array, "n n 4"], plan: Layout, ground: SoftMaps
) -> Float[Array, "n n 4"]:
    """Correction of a tile whose outermost `block` cells take the values of `ring`."""
    k, n = plan.block, plan.side
    out, inner = ring.copy(), slice(k, n - k)
    out[inner, inner] = 0
    source = -sum_steps(labels, shift, ground)
    around = np.zeros_like(out)  # known neighbours
    around[1:] += out[:-1]
    around[:-1] += out[1:]
    around[:, 1:] += out[:, :-1]
    around[:, :-1] += out[:, 1:]
    spectrum = dst(dst((source - around)[inner, inner], type=1, axis=0), type=1, axis=1)
    spectrum /= -(_fixed(n - 2 * k)[:, None] + _fixed(n - 2 * k)[None])[..., None]
    out[inner, inner] = idst(idst(spectrum, type=1, axis=1), type=1, axis=0)
    return out


def border_values(
    plan: Layout, vertical: Float[Array, "2 n w 4"], horizontal: Float[Array, "2 w n 4"], number: int
) -> Float[Array, "n n 4"]:
    """The strips' corrections along a tile's border, by its edge colours; 0 in the corners."""
    n, b = plan.side, plan.strip
    west, north, east, south = edge_colours(number)
    out = np.zeros((n, n, 4))
    ends = slice(b, n - b)
    out[ends, :b], out[ends, n - b :] = vertical[west][ends, b:], vertical[east][ends, :b]
    out[:b, ends], out[n - b :, ends] = horizontal[south][b:, ends], horizontal[north][:b, ends]
    return out


def coarsen_correction(
    correction: Float[Array, "n n 4"], labels: UInt8[Array, "n n"], coarse: UInt8[Array, "k k"]
) -> Float[Array, "k k 4"]:
    """The correction on a coarser grid: its mean over the finest cells that carry the coarse cell's label."""
    k, f = len(coarse), len(labels) // len(coarse)
    same = (labels.reshape(k, f, k, f) == coarse[:, None, :, None])[..., None]
    return (correction.reshape(k, f, k, f, 4) * same).sum((1, 3)) / same.sum((1, 3))


def _fixed(n: int) -> Float[Array, "n"]:
    """Eigenvalues of minus the second difference on n cells between two cells that are 0."""
    return 2 - 2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))


def _free(n: int) -> Float[Array, "n"]:
    """The same between two free ends."""
    return 2 - 2 * np.cos(np.pi * np.arange(n) / n)
