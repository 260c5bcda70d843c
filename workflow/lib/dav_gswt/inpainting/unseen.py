"""Which ground no photo saw, which Gaussians that is, and which pixels look at it."""

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.ground import Ground

UNKNOWN = 0.5  # uncertainty of a disc above which no photo fitted it, either
TOUCHES = 0.1  # of a pixel's blend weight that, if it is of certain Gaussians, the pixel shows something of them
LOOKS = 0.5  # of a pixel's blend weight that must be of certain Gaussians for the pixel to look at them


def cells(field: GaussianField, grid: Ground) -> Bool[Array, "rows columns"]:
    """The cells that no photo saw: not `seen` when the ground was coloured, and in doubt since.

    The grid alone would say too much: it calls a cell unseen where something stood in front before the fit, and the
    fit often clears that away. None where the field has no ground layer.
    """
    n = grid.heights.size
    if not field.ground[:n].any():
        return np.zeros(grid.shape, bool)
    return ~grid.seen & (field.uncertainty[:n] > UNKNOWN).reshape(grid.shape)


def gaussians(field: GaussianField, grid: Ground, there: Bool[Array, "rows columns"]) -> Bool[Array, "n"]:
    """The discs of some cells, and of the underlay what lies under such cells alone."""
    marked = np.zeros(len(field), bool)
    marked[: there.size] = there.ravel()
    rows, s = underlay.find_rows(field, grid), underlay.STRIDE
    if rows.stop > rows.start:
        even = np.pad(there, [(0, -size % s) for size in there.shape], constant_values=True)
        blocks = even.reshape(even.shape[0] // s, s, even.shape[1] // s, s).all((1, 3))
        marked[rows] = blocks.ravel()
    return marked


def share(field: GaussianField, marked: Bool[Array, "n"], camera: Camera) -> Float32[Array, "h w"]:
    """Of every pixel's blend weight, what marked Gaussians have of it; 0 where nothing is."""
    seen = Rasterizer().forward(**to_raster_arrays(field, marked.astype(np.float32)[:, None]), camera=camera)
    return np.clip(seen.colour[..., 0], 0, 1)


def looking(field: GaussianField, marked: Bool[Array, "n"], camera: Camera) -> Bool[Array, "h w"]:
    """The pixels that look at marked Gaussians."""
    return share(field, marked, camera) > LOOKS
