"""The ground that no photo saw: its cells, its Gaussians, and the pixels that look at it."""

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.ground import Ground

LEAST_UNCERTAINTY = 0.5  # of a disc that no photo fitted
TOUCHED = 0.1  # share of a pixel's blend weight from which the pixel shows something of certain Gaussians
LOOKS = 0.5  # share of a pixel's blend weight from which the pixel looks at certain Gaussians


def find_unseen_cells(field: GaussianField, grid: Ground) -> Bool[Array, "rows columns"]:
    """The cells that no photo saw: not `seen` when the ground was coloured, and still uncertain after the fit.

    The grid alone would include cells that were occluded before the fit, which often removes the occluder. No cell if
    the field has no ground layer.
    """
    n = grid.heights.size
    if not field.ground[:n].any():
        return np.zeros(grid.shape, bool)
    return ~grid.seen & (field.uncertainty[:n] > LEAST_UNCERTAINTY).reshape(grid.shape)


def select_gaussians(field: GaussianField, grid: Ground, cells: Bool[Array, "rows columns"]) -> Bool[Array, "n"]:
    """The discs of some cells, and the discs of the underlay that lie under such cells alone."""
    marked = np.zeros(len(field), bool)
    marked[: cells.size] = cells.ravel()
    rows, s = underlay.find_rows(field, grid), underlay.STRIDE
    if rows.stop > rows.start:
        even = np.pad(cells, [(0, -size % s) for size in cells.shape], constant_values=True)
        blocks = even.reshape(even.shape[0] // s, s, even.shape[1] // s, s).all((1, 3))
        marked[rows] = blocks.ravel()
    return marked


def render_share(field: GaussianField, marked: Bool[Array, "n"], camera: Camera) -> Float32[Array, "h w"]:
    """The share of marked Gaussians in the blend weight of every pixel; 0 in empty pixels."""
    render = make_rasterizer().forward(**to_raster_arrays(field, marked.astype(np.float32)[:, None]), camera=camera)
    return np.clip(render.colour[..., 0], 0, 1)


def mask_pixels(field: GaussianField, marked: Bool[Array, "n"], camera: Camera) -> Bool[Array, "h w"]:
    """The pixels that look at marked Gaussians."""
    return render_share(field, marked, camera) > LOOKS
