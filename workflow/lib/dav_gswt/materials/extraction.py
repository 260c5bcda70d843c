"""Take a field apart: an exemplar of each material alone, and each object as Gaussians around its foot."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation, distance_transform_edt, gaussian_filter

from dav_gswt.field import SH0, GaussianField, concatenate_fields
from dav_gswt.materials.filling import CellSources
from dav_gswt.materials.maps import GroundMaps
from dav_gswt.materials.objects import Footprint, measure_size
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import compose

WIDE = 1 / 16  # of the side: blur of the heights and colours that filled cells are given
EVENED = 0.7  # share of such differences of tone that is taken away
FILLED = 0.3  # uncertainty of filled ground, at least: patches of photographed ground are preferred
TALL = 3.0  # times the upper quartile of the heights of what stands on a material: above are crowns that reach over it
SHORT = 4.0  # cells that anything may stand above the ground
SKIRT = 0.12  # of an object's width, at least 3 cells: ground around it that fades out
LIFT = 0.5  # cells that an object's ground lies above other ground
FAINT = 1e-3  # share of an opacity below which a Gaussian is left out


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
