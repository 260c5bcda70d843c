"""Formulas of seams: what one costs, where it is cut, and what the ground is."""

from itertools import product

import numpy as np
from numpy import ndarray as Array

from dav_gswt.study.stability.formula import LAW, Formula, Point, Tolerance
from dav_gswt.tiles import cuts, energy, semantics

SIDE = 8
SIZES = tuple(10.0**power for power in range(-12, 7, 2))
ROWS, COLUMNS = np.mgrid[:SIDE, :SIDE]


def _patches() -> list[Point]:
    """Two patches of one exemplar: colours, what the ground is, a share of colour, and where the second one lies."""
    found, rng = [], np.random.default_rng(0)
    for size in SIZES:
        colour, ground = (rng.uniform(0, 1, (2 * SIDE, SIDE, 3)).astype(np.float32) * np.float32(size) for _ in "cg")
        for share, shift in product((0.0, 0.5, 1.0), (0, SIDE)):
            of = "identical patches" if shift == 0 else "two patches"
            found.append(Point(f"{of}, colours of {size:g}, gamma {share:g}", (colour, ground, share, shift)))
    return found


def _cells(shift: int) -> tuple[Array, Array]:
    return ROWS + shift, COLUMNS


def _cost(colour: Array, ground: Array, share: float, shift: int) -> Array:
    layers = energy.colours(colour), energy.colours(ground)
    terms = [(weight, layer) for weight, layer in zip((share, 1 - share), layers, strict=True) if weight > 0]
    return _both(*energy.weights(terms, _cells(0), _cells(shift)))


def _both(right: Array, upper: Array) -> Array:
    return np.concatenate([np.ravel(right), np.ravel(upper)])


def _parts(colour: Array, ground: Array, share: float, shift: int, kind: type):
    """D and G of each layer over its scale, weighed and summed, by the definition; for right and upper neighbours."""
    d, g = np.zeros(2 * SIDE * (SIDE - 1), kind), np.zeros(2 * SIDE * (SIDE - 1), kind)
    for weight, given in ((share, colour), (1 - share, ground)):
        values = given.astype(kind)
        slope = [np.sqrt((np.gradient(values, axis=axis) ** 2).sum(-1)) for axis in (1, 0)]
        spread = np.sqrt(2 * values.reshape(-1, 3).astype(np.float64).var(0).sum())
        units = energy.scale(2 * float(spread)), energy.scale(4 * float(np.mean(slope, dtype=np.float64)))
        apart = np.sqrt(((values[_cells(0)] - values[_cells(shift)]) ** 2).sum(-1))
        sides = [s[_cells(0)] + s[_cells(shift)] for s in slope]
        d += kind(weight) * _both(apart[:, :-1] + apart[:, 1:], apart[:-1] + apart[1:]) / kind(units[0])
        g += kind(weight) * _both(sides[0][:, :-1] + sides[0][:, 1:], sides[1][:-1] + sides[1][1:]) / kind(units[1])
    return d, g


def _cost_slowly(*given) -> Array:
    d, g = _parts(*given, np.float64)
    return d / (g + energy.EPS)


def _cost_upside_down(*given) -> Array:
    """The appendix: G over D."""
    d, g = _parts(*given, np.float32)
    return g / d


def _grids() -> list[Point]:
    found, rng = [], np.random.default_rng(0)
    for spread in (0, 3, 6, 9):
        right, upper = (10 ** rng.uniform(-spread, 0, shape) for shape in ((4, 3), (3, 4)))
        for size in (1e-12, 1.0, 1e6):
            found.append(Point(f"costs of {size:g} over {spread} decades", (right * size, upper * size)))
    return found


FIRST, SECOND = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
FIRST[:, 0], SECOND[:, 3] = True, True


def _cut(right: Array, upper: Array) -> float:
    """Energy over the largest cost."""
    return cuts.cut(right, upper, FIRST, SECOND).energy / max(right.max(), upper.max())


def _cut_slowly(right: Array, upper: Array) -> float:
    """The least cost of all 256 ways to share out the free cells."""
    best, labels = np.inf, SECOND.copy()
    for free in product((False, True), repeat=8):
        labels[:, 1:3] = np.reshape(free, (4, 2))
        parted = right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum()
        best = min(best, float(parted))
    return best / max(right.max(), upper.max())


def _grounds() -> list[Point]:
    rng = np.random.default_rng(0)
    number = rng.permutation(100)[(ROWS // 2) * 4 + COLUMNS // 2]
    shown = rng.uniform(0, 1, (SIDE, SIDE, 3))
    return [Point(f"colours of {size:g}", (number, shown * size)) for size in (1e-6, 1e-3, 1.0)]


def _semantic(number: Array, colour: Array) -> Array:
    return semantics.of_segments(number, colour, None, {}).distance


def _semantic_slowly(number: Array, colour: Array) -> Array:
    """The same segments under other numbers, by the definition, in the order in which they come."""
    _, first, index = np.unique(number, return_index=True, return_inverse=True)
    order, index = np.argsort(first), index.reshape(number.shape)
    mean = np.array([colour[index == i].mean(0) for i in order])
    count = np.array([(index == i).sum() for i in order])
    middle = (count[:, None] * mean).sum(0) / count.sum()
    spread = np.sqrt(2 * (count[:, None] * (mean - middle) ** 2).sum() / count.sum())
    distance = np.sqrt(((mean[:, None] - mean[None]) ** 2).sum(-1)) / energy.scale(float(spread))
    place = np.argsort(order)[index]
    pairs = np.concatenate(
        [np.stack([a.ravel(), b.ravel()], 1) for a, b in ((place[:, 1:], place[:, :-1]), (place[1:], place[:-1]))]
    )
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], 1), axis=0)
    kind = np.quantile(distance[pairs[:, 0], pairs[:, 1]], semantics.KIND)
    return np.sqrt(np.maximum(0, distance**2 - kind**2))


FORMULAS = [
    Formula(
        "seam weight",
        "seam weight: D / (G + eps)",
        "Eq. (graphcut_main); printed: the appendix",
        "colours 1e-12 to 1e6, gamma 0 to 1, equal patches",
        "float32",
        _patches,
        _cost,
        _cost_slowly,
        Tolerance(LAW[0], 1e-9, LAW[1]),
        _cost_upside_down,
    ),
    Formula(
        "graph cut",
        "the cheapest cut of a grid",
        "Semantic-aware tile synthesis",
        "costs 1e-12 to 1e6 over 9 decades",
        "32 bits",
        _grids,
        _cut,
        _cut_slowly,
        Tolerance(0.0, 24 * 2.0**-33, "24 costs, each half a quantum of 2^-32 of the largest off"),
    ),
    Formula(
        "semantic distance",
        "distance of segments, whatever their numbers",
        "Semantic-aware tile synthesis",
        "colours 1e-6 to 1",
        "float32",
        _grounds,
        _semantic,
        _semantic_slowly,
        Tolerance(LAW[0], 1e-7, LAW[1]),
    ),
]
