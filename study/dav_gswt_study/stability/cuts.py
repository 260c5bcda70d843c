"""Checks of seams: weights of edges, minimum cuts, semantic distance."""

from itertools import product

import numpy as np
from numpy import ndarray as Array

from dav_gswt.tiles import energy, semantics
from dav_gswt_study.stability.formula import FLOAT32, Case, Check

SIDE = 8
SIZES = tuple(10.0**power for power in range(-12, 7, 2))
ROWS, COLUMNS = np.mgrid[:SIDE, :SIDE]


def _patch_cases() -> list[Case]:
    """Two patches of one exemplar: colours, semantic features, gamma, and the offset of the second patch."""
    cases, rng = [], np.random.default_rng(0)
    for size in SIZES:
        colour, ground = (rng.uniform(0, 1, (2 * SIDE, SIDE, 3)).astype(np.float32) * np.float32(size) for _ in "cg")
        for share, shift in product((0.0, 0.5, 1.0), (0, SIDE)):
            of = "identical patches" if shift == 0 else "two patches"
            cases.append(Case(f"{of}, colours of {size:g}, gamma {share:g}", (colour, ground, share, shift)))
    return cases


def _cells(shift: int) -> tuple[Array, Array]:
    return ROWS + shift, COLUMNS


def _weights(colour: Array, ground: Array, share: float, shift: int) -> Array:
    layers = energy.make_colour_layer(colour), energy.make_colour_layer(ground)
    terms = [(weight, layer) for weight, layer in zip((share, 1 - share), layers, strict=True) if weight > 0]
    return _concatenate_edges(*energy.compute_edge_costs(terms, _cells(0), _cells(shift)))


def _concatenate_edges(right: Array, upper: Array) -> Array:
    return np.concatenate([np.ravel(right), np.ravel(upper)])


def _gradient_terms(colour: Array, ground: Array, share: float, shift: int, kind: type):
    """D and G of each layer over its scale, weighted and summed, by the definition; for right and upper neighbours."""
    d, g = np.zeros(2 * SIDE * (SIDE - 1), kind), np.zeros(2 * SIDE * (SIDE - 1), kind)
    for weight, layers in ((share, colour), (1 - share, ground)):
        values = layers.astype(kind)
        slope = [np.sqrt((np.gradient(values, axis=axis) ** 2).sum(-1)) for axis in (1, 0)]
        spread = np.sqrt(2 * values.reshape(-1, 3).astype(np.float64).var(0).sum())
        units = energy.safe_unit(2 * float(spread)), energy.safe_unit(4 * float(np.mean(slope, dtype=np.float64)))
        apart = np.sqrt(((values[_cells(0)] - values[_cells(shift)]) ** 2).sum(-1))
        sides = [s[_cells(0)] + s[_cells(shift)] for s in slope]
        d += kind(weight) * _concatenate_edges(apart[:, :-1] + apart[:, 1:], apart[:-1] + apart[1:]) / kind(units[0])
        g += (
            kind(weight)
            * _concatenate_edges(sides[0][:, :-1] + sides[0][:, 1:], sides[1][:-1] + sides[1][1:])
            / kind(units[1])
        )
    return d, g


def _weights_reference(colour: Array, ground: Array, share: float, shift: int) -> Array:
    d, g = _gradient_terms(colour, ground, share, shift, np.float64)
    return d / (g + energy.EPS)


def _weights_printed(colour: Array, ground: Array, share: float, shift: int) -> Array:
    """The appendix: G over D."""
    d, g = _gradient_terms(colour, ground, share, shift, np.float32)
    return g / d


def _grid_cases() -> list[Case]:
    cases, rng = [], np.random.default_rng(0)
    for spread in (0, 3, 6, 9):
        right, upper = (10 ** rng.uniform(-spread, 0, shape) for shape in ((4, 3), (3, 4)))
        for size in (1e-12, 1.0, 1e6):
            cases.append(Case(f"costs of {size:g} over {spread} decades", (right * size, upper * size)))
    return cases


FIRST, SECOND = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
FIRST[:, 0], SECOND[:, 3] = True, True


def _cut_energy(right: Array, upper: Array) -> float:
    """Energy of the minimum cut over the largest cost."""
    return energy.find_cut(right, upper, FIRST, SECOND).energy / max(right.max(), upper.max())


def _cut_energy_reference(right: Array, upper: Array) -> float:
    """The least energy of all 256 labellings of the free cells."""
    best, labels = np.inf, SECOND.copy()
    for free in product((False, True), repeat=8):
        labels[:, 1:3] = np.reshape(free, (4, 2))
        parted = right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum()
        best = min(best, float(parted))
    return best / max(right.max(), upper.max())


def _ground_cases() -> list[Case]:
    rng = np.random.default_rng(0)
    number = rng.permutation(100)[(ROWS // 2) * 4 + COLUMNS // 2]
    shown = rng.uniform(0, 1, (SIDE, SIDE, 3))
    return [Case(f"colours of {size:g}", (number, shown * size)) for size in (1e-6, 1e-3, 1.0)]


def _segment_distance(number: Array, colour: Array) -> Array:
    return semantics.describe_segments(number, colour, None).distance


def _segment_distance_reference(number: Array, colour: Array) -> Array:
    """By the definition, with segments numbered in order of appearance."""
    _, first, index = np.unique(number, return_index=True, return_inverse=True)
    order, index = np.argsort(first), index.reshape(number.shape)
    mean = np.array([colour[index == i].mean(0) for i in order])
    count = np.array([(index == i).sum() for i in order])
    middle = (count[:, None] * mean).sum(0) / count.sum()
    spread = np.sqrt(2 * (count[:, None] * (mean - middle) ** 2).sum() / count.sum())
    distance = np.sqrt(((mean[:, None] - mean[None]) ** 2).sum(-1)) / energy.safe_unit(float(spread))
    place = np.argsort(order)[index]
    pairs = np.concatenate(
        [np.stack([a.ravel(), b.ravel()], 1) for a, b in ((place[:, 1:], place[:, :-1]), (place[1:], place[:-1]))]
    )
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], 1), axis=0)
    kind = np.quantile(distance[pairs[:, 0], pairs[:, 1]], semantics.SAME_KIND)
    return np.sqrt(np.maximum(0, distance**2 - kind**2))


CHECKS = [
    Check(
        "seam weight: D / (G + eps)",
        _patch_cases,
        _weights,
        _weights_reference,
        relative=FLOAT32,
        absolute=1e-9,
        printed=_weights_printed,
    ),
    Check("the cheapest cut of a grid", _grid_cases, _cut_energy, _cut_energy_reference, absolute=24 * 2.0**-33),
    Check(
        "distance of segments, whatever their numbers",
        _ground_cases,
        _segment_distance,
        _segment_distance_reference,
        relative=FLOAT32,
        absolute=1e-7,
    ),
]
