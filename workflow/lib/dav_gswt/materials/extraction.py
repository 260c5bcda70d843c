"""Take a field apart: an exemplar of each material alone, and each object as Gaussians around its foot.

Cells of an exemplar that show something else are filled with patches of other cells. Square patches of the source are
placed along the rim of the hole, where most is known around, and joined to it along the cheapest seam (Kwatra et al.
2003, "Graphcut textures", in the order of Criminisi et al. 2004). A patch comes from the place that differs least from
what is known, with a charge for ground that other patches show already.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation, distance_transform_edt, gaussian_filter

from dav_gswt.field import SH0, GaussianField, concatenate_fields
from dav_gswt.materials.maps import GroundMaps
from dav_gswt.materials.objects import Footprint, measure_size
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import compose
from dav_gswt.tiles.energy import CostLayer, compute_edge_costs, find_cut
from dav_gswt.tiles.patches import box_sums, divide_by_median

CANDIDATES = 160  # places that are compared for a patch
COMPARED = 256  # cells of a patch that they are compared by
MIN_PLACES = 12  # of a patch: with fewer, patches are made smaller
MIN_PATCH = 4  # cells
REPEAT_COST = 0.5  # charge for ground that is shown once more, where a median place costs 1
WIDE = 1 / 16  # of the side: blur of the heights and colours that filled cells are given
EVENED = 0.7  # share of such differences of tone that is taken away
FILLED = 0.3  # uncertainty of filled ground, at least: patches of photographed ground are preferred
TALL = 3.0  # times the upper quartile of the heights of what stands on a material: above are crowns that reach over it
SHORT = 4.0  # cells that anything may stand above the ground
SKIRT = 0.12  # of an object's width, at least 3 cells: ground around it that fades out
LIFT = 0.5  # cells that an object's ground lies above other ground
FAINT = 1e-3  # share of an opacity below which a Gaussian is left out


@dataclass(frozen=True)
class CellSources:
    """For each cell of an exemplar, the cell that it shows. Cells that are not filled show themselves."""

    rows: Int[Array, "m m"]
    columns: Int[Array, "m m"]

    @property
    def copied(self) -> Bool[Array, "m m"]:
        """Cells that show another one."""
        rows, columns = np.mgrid[: len(self.rows), : len(self.rows)]
        return (rows != self.rows) | (columns != self.columns)


def fill_cells(
    features: Float[Array, "m m k"],
    terms: Sequence[tuple[float, CostLayer]],
    source: Bool[Array, "m m"],
    patch: int,
    rng: np.random.Generator,
) -> CellSources | None:
    """Fill all cells that are not in the source with patches of the source.

    Args:
        features: that places are compared by.
        terms: layers of the seam's cost with their weights (`SeamEnergy.terms`).
        source: cells that stay, and that patches are taken from.
        patch: side of a patch in cells; halved while the source has too few places for it.
    Returns: None where the source has no room for the smallest patch.
    """
    places = find_places(source, patch)
    while len(places) < MIN_PLACES and patch > MIN_PATCH:
        patch = max(MIN_PATCH, patch // 2)
        places = find_places(source, patch)
    if not len(places):
        return None
    state = _Filling(features, terms, source, places, patch, rng)
    while (corner := state.next_corner()) is not None:
        state.place_patch(*corner)
    return CellSources(state.rows, state.columns)


def find_places(source: Bool[Array, "m m"], patch: int) -> Int[Array, "n 2"]:
    """South-western cells (row, column) of all squares of `patch` cells that lie in the source."""
    if patch > len(source):
        return np.zeros((0, 2), int)
    return np.argwhere(box_sums(source, patch, patch) == patch * patch)


class _Filling:
    """A map that is being filled."""

    def __init__(self, features, terms, source, places, patch: int, rng: np.random.Generator):
        self.features, self.terms, self.places, self.patch, self.rng = features, terms, places, patch, rng
        self.rows, self.columns = np.mgrid[: len(source), : len(source)]
        self.known = source.copy()
        self.shown = np.zeros(source.shape)  # how often each cell has been copied
        last = len(source) - patch
        self.starts = np.unique(np.append(np.arange(0, last + 1, max(1, patch // 2)), last))
        self.counts = box_sums(source, patch, patch)[np.ix_(self.starts, self.starts)]  # known cells from each start

    def next_corner(self) -> tuple[int, int] | None:
        """Where the next patch goes: of the places on a grid that are not full, the one with most known cells."""
        counts = np.where(self.counts == self.patch**2, -1, self.counts)
        row, column = np.unravel_index(int(counts.argmax()), counts.shape)
        return None if counts.max() < 0 else (int(self.starts[row]), int(self.starts[column]))

    def place_patch(self, row: int, column: int) -> None:
        """Choose a patch for a place, cut it against what is known there, and copy it."""
        p = self.patch
        window = np.s_[row : row + p, column : column + p]
        known = self.known[window]
        here = self.rows[window], self.columns[window]
        y, x = self._choose_place(known, here)
        there = tuple(np.mgrid[y : y + p, x : x + p])
        new = self._cut_patch(known, here, (there[0], there[1]))
        self.rows[window] = np.where(new, there[0], here[0])
        self.columns[window] = np.where(new, there[1], here[1])
        self.shown[y : y + p, x : x + p] += new
        self.known[window] = True
        near = [np.flatnonzero(np.abs(self.starts - at) < p) for at in (row, column)]
        for i in near[0]:
            for j in near[1]:
                r, c = self.starts[i], self.starts[j]
                self.counts[i, j] = self.known[r : r + p, c : c + p].sum()

    def _choose_place(self, known: Bool[Array, "p p"], here: tuple[Array, Array]) -> tuple[int, int]:
        drawn = self.rng.integers(len(self.places), size=min(CANDIDATES, len(self.places)))
        drawn = self.places[np.unique(drawn)]
        y, x = np.nonzero(known)
        if len(y) > COMPARED:
            pick = self.rng.choice(len(y), COMPARED, replace=False)
            y, x = y[pick], x[pick]
        wanted = self.features[here[0][y, x], here[1][y, x]]
        found = self.features[drawn[:, :1] + y, drawn[:, 1:] + x]
        cost = divide_by_median(((found - wanted) ** 2).sum(-1).mean(-1)) if len(y) else np.zeros(len(drawn))
        inside = np.arange(self.patch)
        often = self.shown[drawn[:, :1, None] + inside[:, None], drawn[:, 1:, None] + inside].mean((1, 2))
        best = drawn[int(np.argmin(cost + REPEAT_COST * often))]
        return int(best[0]), int(best[1])

    def _cut_patch(self, known: Array, here: tuple[Array, Array], there: tuple[Array, Array]) -> Bool[Array, "p p"]:
        """Which cells show the new patch: all that are not known, and beyond the cheapest seam through those that are.

        Known cells on the rim stay, so no seam leaves the patch.
        """
        rim = np.ones_like(known)
        rim[1:-1, 1:-1] = False
        keep = known & rim
        if not keep.any():
            return ~known if known.any() else np.ones_like(known)
        return find_cut(*compute_edge_costs(self.terms, here, there), keep, ~known).labels


def extract_exemplar(
    field: GaussianField, grid: Ground, maps: GroundMaps, sources: CellSources, own: Bool[Array, "m m"]
) -> tuple[GaussianField, Ground]:
    """The exemplar with every cell showing its source: a field and a grid without a margin.

    A copied cell is given the height and the tone of its place: both are shifted by the difference of the material's
    blurred maps between the two places. Tones are drawn towards the material's mean, as a patch of darker ground in a
    tile is a lattice on the terrain. own: the cells that the material is made of.
    """
    m, spacing = maps.cells, grid.spacing
    lift = _shift_between(maps.height[..., None], own, sources, 0.0)[..., 0]
    tone = _shift_between(maps.colour, own, sources, EVENED)
    block = np.s_[grid.first_row : grid.first_row + m, grid.first_column : grid.first_column + m]
    west, south, _ = grid.exemplar
    heights = grid.heights[block][sources.rows, sources.columns] + lift
    seen = grid.seen[block][sources.rows, sources.columns]
    small = Ground(west, south, spacing, 0, 0, m, heights, seen)
    number = np.arange(grid.heights.size).reshape(grid.shape)[block]
    ground = field[number[sources.rows, sources.columns].ravel()]
    rows, columns = np.mgrid[:m, :m]
    move = np.stack([columns - sources.columns, rows - sources.rows], -1) * spacing
    ground = _move(ground, np.concatenate([move, lift[..., None]], -1).reshape(-1, 3))
    ground = _tint(_mark_filled(ground, sources.copied.ravel()), tone.reshape(-1, 3))
    parts = [ground]
    if (under := discs.find_underlay(field, grid)).stop > under.start:
        parts.append(discs.make_underlay(small, ground))
    standing = _drop_crowns(bin_standing(field, grid, maps), maps, own)
    return concatenate_fields([*parts, _copy_standing(standing, sources, np.dstack([lift, tone]))]), small


def _drop_crowns(standing: compose.BinnedLevel, maps: GroundMaps, own: Bool[Array, "m m"]) -> compose.BinnedLevel:
    """Leave out what floats far above a material: the crown of a tree beside it would be a veil on its tiles."""
    cell = np.repeat(np.arange(own.size), np.diff(standing.start))
    above = standing.field.means[:, 2] - maps.height.ravel()[cell]
    usual = above[own.ravel()[cell]]
    if not len(usual):
        return standing
    limit = max(TALL * float(np.quantile(usual, 0.75)), SHORT * maps.exemplar.spacing)
    return compose.bin_gaussians(standing.field[above <= limit], maps.exemplar, 1)


def _shift_between(
    values: Float[Array, "m m c"], own: Bool[Array, "m m"], sources: CellSources, evened: float
) -> Float[Array, "m m c"]:
    """Blurred values of each cell's place, drawn towards their mean by a share, less those of its source."""
    soft = np.dstack([blur_over(layer, own, WIDE * len(own)) for layer in np.moveaxis(values, -1, 0)])
    wanted = soft + evened * (soft[own].mean(0) - soft)
    return wanted - soft[sources.rows, sources.columns]


def _copy_standing(standing: compose.BinnedLevel, sources: CellSources, shift: Float[Array, "m m 4"]) -> GaussianField:
    """What stands over each cell's source, moved to the cell. shift: of its height and its colour."""
    index, count = compose.gather_cells(standing, sources.rows, sources.columns)
    rows, columns = np.mgrid[: standing.cells, : standing.cells]
    move = np.stack([columns - sources.columns, rows - sources.rows], -1) * standing.exemplar.spacing
    move = np.concatenate([move, shift[..., :1]], -1).reshape(-1, 3).repeat(count, axis=0)
    copies = _mark_filled(_move(standing.field[index], move), sources.copied.ravel().repeat(count))
    return _tint(copies, shift[..., 1:].reshape(-1, 3).repeat(count, axis=0))


def extract_object(
    field: GaussianField, grid: Ground, maps: GroundMaps, standing: compose.BinnedLevel, footprint: Footprint
) -> GaussianField:
    """An object's Gaussians: what stands over its footprint, and its ground with a skirt that fades out.

    Positions count from the middle of the footprint, on the plane of the ground around it. standing: `bin_standing`.
    """
    m, spacing = maps.cells, grid.spacing
    width = max(3, round(SKIRT * measure_size(footprint.cells)))
    ring = binary_dilation(footprint.cells, iterations=width) & ~footprint.cells
    share = np.clip(1 - distance_transform_edt(~footprint.cells) / (width + 1), 0, 1)
    rows, columns = np.nonzero(footprint.cells)
    foot = np.array([columns.mean() + 0.5, rows.mean() + 0.5])
    plane = _fit_plane(maps.height, ring, foot)
    number = np.arange(grid.heights.size).reshape(grid.shape)
    number = number[grid.first_row : grid.first_row + m, grid.first_column : grid.first_column + m]
    near = footprint.cells | ring
    ground = _scale_opacity(field[number[near]], share[near])
    ground = replace(ground, means=ground.means + np.array([0, 0, LIFT * spacing], np.float32))
    over = np.nonzero(binary_dilation(footprint.cells))
    index, _ = compose.gather_cells(standing, over[0][None], over[1][None])
    parts = concatenate_fields([ground, standing.field[index]])
    west, south, _ = grid.exemplar
    means = parts.means.astype(float) - [west + foot[0] * spacing, south + foot[1] * spacing, 0]
    means[:, 2] -= plane[0] + means[:, :2] @ plane[1:] / spacing
    return replace(parts, means=means.astype(np.float32))


def blur_over(values: Float[Array, "m m"], own: Bool[Array, "m m"], cells: float) -> Float[Array, "m m"]:
    """Values blurred over the cells that count; where there are none near, the nearest such value.

    The plane that fits best is left out of the blur, so that a slope goes on through a gap.
    """
    rows, columns = np.mgrid[: len(own), : len(own)] / len(own)
    system = np.stack([np.ones(own.shape), columns, rows], -1)
    plane = system @ np.linalg.lstsq(system[own], values[own], rcond=None)[0]
    values = values - plane
    weight = gaussian_filter(own.astype(float), cells, mode="nearest")
    total = gaussian_filter(np.where(own, values, 0), cells, mode="nearest")
    known = weight > 1e-3
    nearest = tuple(distance_transform_edt(~known, return_distances=False, return_indices=True))
    return (total / np.maximum(weight, 1e-6))[nearest] + plane


def _fit_plane(height: Float[Array, "m m"], cells: Bool[Array, "m m"], foot: Float[Array, "2"]) -> Float[Array, "3"]:
    """Height at the foot, and rise per cell to the east and to the north, by least squares."""
    rows, columns = np.nonzero(cells)
    if len(rows) < 3:
        return np.array([height[int(foot[1]), int(foot[0])], 0.0, 0.0])
    system = np.stack([np.ones(len(rows)), columns + 0.5 - foot[0], rows + 0.5 - foot[1]], 1)
    return np.linalg.lstsq(system, height[cells], rcond=None)[0]


def bin_standing(field: GaussianField, grid: Ground, maps: GroundMaps) -> compose.BinnedLevel:
    """What stands on the ground: neither discs nor underlay, by the exemplar's cells."""
    return compose.bin_gaussians(discs.remove_underlay(field, grid)[grid.heights.size :], maps.exemplar, 1)


def _move(field: GaussianField, by: Float[Array, "n 3"]) -> GaussianField:
    return replace(field, means=(field.means.astype(float) + by).astype(np.float32))


def _tint(field: GaussianField, by: Float[Array, "n 3"]) -> GaussianField:
    sh = field.sh.copy()
    sh[:, 0] += (by / SH0).astype(np.float32)
    return replace(field, sh=sh)


def _mark_filled(field: GaussianField, filled: Bool[Array, "n"]) -> GaussianField:
    uncertain = np.maximum(field.uncertainty, np.float32(FILLED))
    return replace(field, uncertainty=np.where(filled, uncertain, field.uncertainty))


def _scale_opacity(field: GaussianField, share: Float[Array, "n"]) -> GaussianField:
    """Opacities times a share; those that vanish are left out."""
    keep = share > FAINT
    field, share = field[keep], share[keep]
    opacity = share / (1 + np.exp(-field.opacity_logits.astype(float)))
    logits = np.where(share < 1, np.log(opacity) - np.log1p(-opacity), field.opacity_logits)
    return replace(field, opacity_logits=logits.astype(np.float32))
