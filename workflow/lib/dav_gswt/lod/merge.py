"""Merge a level's Gaussians to a quarter as many: ground discs four to one, objects by moments within voxels."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.top_view import render_top_view

LEAST_WEIGHT = 1e-200  # of a Gaussian that is merged; sums of smaller ones lose their digits, or are 0


def crop_to_blocks(field: GaussianField, grid: Ground, block: int) -> tuple[GaussianField, Ground]:
    """Field and grid cut down to whole blocks of cells that start at the exemplar's corner."""
    rows_of_underlay = discs.find_underlay(field, grid)
    has_underlay = rows_of_underlay.stop > rows_of_underlay.start
    field = discs.remove_underlay(field, grid)
    rows, columns = grid.shape
    below, left = grid.first_row % block, grid.first_column % block
    ny, nx = (rows - below) // block * block, (columns - left) // block * block
    window = np.s_[below : below + ny, left : left + nx]
    keep = np.arange(rows * columns).reshape(rows, columns)[window].ravel() if field.ground.any() else []
    small = replace(
        grid,
        west=grid.west + left * grid.spacing,
        south=grid.south + below * grid.spacing,
        first_row=grid.first_row - below,
        first_column=grid.first_column - left,
        heights=grid.heights[window],
        seen=grid.seen[window],
    )
    inside = np.flatnonzero(~field.ground)
    inside = inside[small.contains(field.means[inside])]
    ground_discs, objects = field[np.asarray(keep, int)], field[inside]
    layers = [discs.make_underlay(small, ground_discs)] if has_underlay else []
    return concatenate_fields([ground_discs, *layers, objects]), small


def halve_resolution(field: GaussianField, grid: Ground) -> tuple[GaussianField, Ground]:
    """Twice the spacing: four discs become one with their mean colour, height and uncertainty; objects merge likewise.

    The grid's shape, first_row, first_column and cells must be even (see `crop_to_blocks`).
    """
    coarse = replace(
        grid,
        spacing=2 * grid.spacing,
        first_row=grid.first_row // 2,
        first_column=grid.first_column // 2,
        cells=grid.cells // 2,
        heights=_mean4(grid.heights),
        seen=_mean4(grid.seen.astype(float)) > 0.5,
    )
    n = grid.heights.size
    if field.ground.any():
        colours = field.base_colours[:n].reshape(*grid.shape, 3)
        uncertainty, objects = field.uncertainty[:n].reshape(grid.shape), discs.remove_underlay(field, grid)[n:]
    else:  # an imported field: its ground is its top view, objects are what lies above the height of discs
        maps = render_top_view(field, grid)
        colours, uncertainty = maps.colour, maps.uncertainty
        above = field.means[:, 2] - grid.height_at(field.means)
        objects = field[above > discs.OBJECT_HEIGHT * coarse.spacing]
    base = discs.make_ground_discs(coarse, _mean4(colours.astype(float)).reshape(-1, 3))
    base = replace(base, uncertainty=_mean4(uncertainty.astype(float)).ravel().astype(np.float32))
    return concatenate_fields(
        [base, discs.make_underlay(coarse, base), merge_by_voxel(objects, coarse.spacing)]
    ), coarse


def merge_by_voxel(field: GaussianField, voxel: float) -> GaussianField:
    """Gaussians of one voxel as one Gaussian with their common mean, covariance, colour and opaque area.

    Weights are opacity times the area of the two larger axes, as visible in a picture. The merged opacity keeps
    the sum of those weights, at most 0.99. Gaussians below LEAST_WEIGHT, which no picture shows, are left out. Colours
    do not depend on the view.
    """
    weight = _weigh(field)
    field, weight = field[weight > LEAST_WEIGHT], weight[weight > LEAST_WEIGHT]
    if not len(field):
        return replace(field, sh=field.sh[:, :1])
    key = np.floor(field.means / voxel).astype(np.int64)
    _, cell = np.unique(key, axis=0, return_inverse=True)
    cell = cell.ravel()
    total = np.bincount(cell, weight)

    def mean(values: Float[Array, "n d"]) -> Float[Array, "m d"]:
        return np.stack([np.bincount(cell, weight * v) / total for v in values.T], 1)

    centre = mean(field.means.astype(float))
    away = field.means - centre[cell]
    spread = compute_covariances(field) + away[:, :, None] * away[:, None, :]
    variance, axes = np.linalg.eigh(mean(spread.reshape(-1, 9)).reshape(-1, 3, 3))
    axes[np.linalg.det(axes) < 0, :, 0] *= -1
    size = np.sqrt(np.maximum(variance, 1e-20))
    opacity = np.clip(total / (size[:, 1] * size[:, 2]), 0.01, 0.99)
    return GaussianField(
        centre.astype(np.float32),
        np.log(size).astype(np.float32),
        Rotation.from_matrix(axes).as_quat(scalar_first=True).astype(np.float32),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        rgb_to_sh(mean(field.base_colours.astype(float))),
        mean(field.uncertainty[:, None].astype(float))[:, 0].astype(np.float32),
        np.zeros(len(centre), bool),
    )


def _weigh(field: GaussianField) -> Float[Array, "n"]:
    """Opacity times the area of the two larger axes."""
    scales = np.sort(np.exp(field.log_scales.astype(float)), 1)
    with np.errstate(over="ignore"):  # of the power, for a logit that no double tells from opacity 0
        return scales[:, 1] * scales[:, 2] / (1 + np.exp(-field.opacity_logits.astype(float)))


def compute_covariances(field: GaussianField) -> Float[Array, "n 3 3"]:
    """World covariances R diag(sigma^2) R^T."""
    axes = Rotation.from_quat(field.quats.astype(float), scalar_first=True).as_matrix()
    half = axes * np.exp(field.log_scales.astype(float))[:, None, :]
    return half @ half.transpose(0, 2, 1)


def _mean4(values: Array) -> Array:
    rows, columns = values.shape[:2]
    return values.reshape(rows // 2, 2, columns // 2, 2, *values.shape[2:]).mean((1, 3))
