"""Orthographic top view of a field, one pixel a cell of a ground grid; rows from south to north, as the grid's."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction.ground import Ground

MIN_ALPHA = 1e-6


@dataclass(frozen=True)
class TopView:
    """Maps over the cells. colour and height are divided by alpha; 0 where nothing is."""

    colour: Float32[Array, "rows columns 3"]
    height: Float32[Array, "rows columns"]
    alpha: Float32[Array, "rows columns"]
    uncertainty: Float32[Array, "rows columns"]

    def colour_or_nan(self) -> Float32[Array, "rows columns 3"]:
        """The colour, NaN where nothing is."""
        return np.where(self.alpha[..., None] > MIN_ALPHA, self.colour, np.float32(np.nan))


def render_exemplar(field: GaussianField, grid: Ground) -> TopView:
    """The top view of the exemplar's cells alone."""
    block = np.s_[grid.first_row : grid.first_row + grid.cells, grid.first_column : grid.first_column + grid.cells]
    return TopView(*(m[block] for m in vars(render_top_view(field, grid)).values()))


def render_top_view(field: GaussianField, grid: Ground) -> TopView:
    """Render the field by an orthographic camera over the grid, above its highest Gaussian."""
    rows, columns = grid.shape
    top = float(field.means[:, 2].max()) + 10 * grid.spacing
    camera = cameras.top_down(grid.west, grid.south, columns, rows, grid.spacing, top)
    raster = make_rasterizer()
    seen = raster.forward(**to_raster_arrays(field), camera=camera)
    uncertain = raster.forward(**to_raster_arrays(field, field.uncertainty[:, None]), camera=camera)
    solid = np.maximum(seen.alpha, MIN_ALPHA)
    maps = TopView(
        seen.colour / solid[..., None],
        np.where(seen.alpha > MIN_ALPHA, top - seen.depth / solid, 0),
        seen.alpha,
        np.clip(uncertain.colour[..., 0] + 1 - seen.alpha, 0, 1),
    )
    return TopView(*(np.ascontiguousarray(m[::-1], np.float32) for m in vars(maps).values()))
