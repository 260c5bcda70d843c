"""Whether borders between materials on a terrain look like photographed ones: Seam-LPIPS of crops across them.

Each crop shows two materials. Its distance is the mean of its nearest few among crops of photographed borders, in all
eight symmetries. That of a photographed crop, to those that do not overlap it, is the spread of photographed borders.
Crops inside the materials, measured alike, say how much of the difference has nothing to do with borders.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.raster import render
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import collect_cells
from dav_gswt_study.materials.accuracy import FoundLabels
from dav_gswt_study.seams.perceptual_distance import NEIGHBOURS, embed_images, pairwise_distances

CELLS, PIXELS = 48, 2  # ground cells along a side of a crop, and pixels of a cell
STEP = 8  # cells between photographed crops
LEAST, CLEAR = 0.2, 0.7  # share of a crop that each of two materials has, and that is no object and not excluded
MOST = 0.02  # share of a crop inside a material that is another one
CROPS, TILES = 80, 8  # of the terrain at most, and sides of the piece of it that they are cut from
REPLICATES, LEVEL = 2000, 0.95


@dataclass(frozen=True)
class TransitionMeasures:
    """terrain, photographed: mean distances; None without a border. low, high: interval of their difference. crops: how
    many of each. inside: the difference inside the materials, the mean over those that were photographed on enough
    ground."""

    terrain: float | None = None
    photographed: float | None = None
    difference: float | None = None
    low: float | None = None
    high: float | None = None
    terrain_crops: int = 0
    photographed_crops: int = 0
    inside: float | None = None


@dataclass(frozen=True)
class MaterialMap:
    """A picture from above and the material of each of its cells, -1 where it is none; the northern row first."""

    picture: Float32[Array, "h w 3"]
    material: Int[Array, "rows columns"]


def map_photographed(field: GaussianField, grid: Ground, found: FoundLabels) -> MaterialMap:
    """The exemplar as it was fitted."""
    west, south, _ = grid.exemplar
    top, side = float(field.means[:, 2].max()) + 10 * grid.spacing, PIXELS * grid.cells
    picture = render(field, cameras.top_down(west, south, side, side, grid.spacing / PIXELS, top)).colour
    number = int(found.material.max()) + 1
    clear = ~found.excluded & (found.object == 0) & (found.kind < number)
    return MaterialMap(picture, np.where(clear, found.material, -1)[::-1])


def map_terrain(terrain: EndlessTerrain, spacing: float, tiles: int = TILES) -> MaterialMap:
    """`tiles` x `tiles` cells of the terrain. Raises: InputError: it has one material."""
    classes = terrain.classes
    if classes is None:
        raise InputError("transitions: the terrain has one material; there is no border to measure")
    across = round(tiles * terrain.side / spacing)
    field = collect_cells(terrain, -1, -1, tiles + 2, tiles + 2, 0)
    step, top = tiles * terrain.side / across / PIXELS, float(field.means[:, 2].max()) + terrain.side
    side = PIXELS * across
    picture = render(field, cameras.top_down(terrain.side, terrain.side, side, side, step, top)).colour
    at = (np.arange(across) + 0.5) * tiles / across
    x, y = (v.ravel() for v in np.meshgrid(at, at))
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    scores = classes.scores_at(i, j, x - i, y - j)
    return MaterialMap(picture, scores.argmax(1).reshape(across, across)[::-1])


def find_borders(material: Int[Array, "rows columns"], step: int) -> Int[Array, "n 2"]:
    """First row and column, in cells, of squares in which two materials have enough room."""
    return _find_squares(material, step, lambda shares: np.sort(shares)[-2] >= LEAST)


def find_insides(material: Int[Array, "rows columns"], step: int, number: int) -> Int[Array, "n 2"]:
    """First row and column, in cells, of squares that show one material and hardly any other."""
    return _find_squares(material, step, lambda shares: shares.sum() - shares[number] <= MOST)


def _find_squares(
    material: Int[Array, "rows columns"], step: int, fits: Callable[[Float[Array, "m"]], bool]
) -> Int[Array, "n 2"]:
    """Squares of clear ground whose materials have shares that fit."""
    rows, columns = material.shape
    least = max(2, int(material.max()) + 1)
    found = []
    for row in range(0, rows - CELLS + 1, step):
        for column in range(0, columns - CELLS + 1, step):
            inside = material[row : row + CELLS, column : column + CELLS]
            shares = np.bincount(inside[inside >= 0], minlength=least) / CELLS**2
            if shares.sum() >= CLEAR and fits(shares):
                found.append((row, column))
    return np.array(found, int).reshape(-1, 2)


def measure_transitions(
    photographed: MaterialMap, terrain: MaterialMap, weights: Weights, seed: int
) -> TransitionMeasures:
    """Raises: InputError: too few borders were photographed, or none lies in the piece of the terrain."""
    places, others = find_borders(photographed.material, STEP), find_borders(terrain.material, STEP)
    if len(places) < NEIGHBOURS + 1 or not len(others):
        raise InputError("transitions: too few borders between two materials were photographed to compare others with")
    rng = np.random.default_rng(seed)
    away, spread = _compare(photographed, terrain, places, _choose(others, rng), weights)
    if not len(spread):
        raise InputError("transitions: all photographed borders overlap each other; take photos of a larger ground")
    difference = float(away.mean() - spread.mean())
    low, high = bootstrap_difference(away, spread, rng)
    inside = []
    for number in range(int(photographed.material.max()) + 1):
        places, others = (find_insides(each.material, STEP, number) for each in (photographed, terrain))
        if len(places) > NEIGHBOURS and len(others):
            made, own = _compare(photographed, terrain, _choose(places, rng), _choose(others, rng), weights)
            inside += [made.mean() - own.mean()] if len(own) else []
    means = float(away.mean()), float(spread.mean())
    sizes = len(away), len(spread)
    return TransitionMeasures(*means, difference, low, high, *sizes, float(np.mean(inside)) if inside else None)


def _choose(places: Int[Array, "n 2"], rng: np.random.Generator) -> Int[Array, "k 2"]:
    """At most CROPS of them."""
    return places[np.sort(rng.permutation(len(places))[:CROPS])]


def _compare(
    photographed: MaterialMap,
    terrain: MaterialMap,
    places: Int[Array, "n 2"],
    others: Int[Array, "m 2"],
    weights: Weights,
) -> tuple[Float[Array, "m"], Float[Array, "k"]]:
    """Distances of the terrain's crops to photographed ones, and of those photographed ones that have some apart."""
    bank, _ = embed_images(turn_crops(cut_crops(photographed.picture, places)), weights)
    own, _ = embed_images(cut_crops(photographed.picture, places), weights)
    made, _ = embed_images(cut_crops(terrain.picture, others), weights)
    apart = np.abs(places[:, None] - places[None]).max(-1) >= CELLS
    everywhere = np.ones((len(others), len(places)), bool)
    spread = average_nearest(pairwise_distances(own, bank), apart)
    return average_nearest(pairwise_distances(made, bank), everywhere), spread[np.isfinite(spread)]


def cut_crops(picture: Float32[Array, "h w 3"], places: Int[Array, "n 2"]) -> Float32[Array, "n s s 3"]:
    """Crops of CELLS x CELLS cells."""
    side = PIXELS * CELLS
    corners = (PIXELS * places).tolist()
    return np.stack([np.clip(picture[y : y + side, x : x + side], 0, 1) for y, x in corners]).astype(np.float32)


def turn_crops(crops: Float32[Array, "n s s 3"]) -> Float32[Array, "k s s 3"]:
    """All crops in the eight symmetries of a square, one symmetry after the other."""
    both = (crops, crops[:, :, ::-1])
    return np.concatenate([np.rot90(each, turn, (1, 2)) for each in both for turn in range(4)])


def average_nearest(apart: Float[Array, "n k"], allowed: Bool[Array, "n m"]) -> Float[Array, "n"]:
    """Mean of the NEIGHBOURS smallest distances to allowed crops, each in its best symmetry; NaN with too few."""
    n, m = allowed.shape
    best = np.where(allowed, apart.reshape(n, -1, m).min(1), np.inf)
    nearest = np.sort(best, 1)[:, :NEIGHBOURS].mean(1)
    return np.where(np.isfinite(nearest), nearest, np.nan)


def bootstrap_difference(a: Float[Array, "n"], b: Float[Array, "m"], rng: np.random.Generator) -> tuple[float, float]:
    """Interval of mean(a) - mean(b), each drawn anew."""
    means = [
        a[rng.integers(len(a), size=len(a))].mean() - b[rng.integers(len(b), size=len(b))].mean()
        for _ in range(REPLICATES)
    ]
    low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high)
