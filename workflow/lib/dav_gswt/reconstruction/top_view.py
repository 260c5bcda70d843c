"""Maps of a field from straight above, one pixel a cell of a ground grid; rows from south to north, as the grid's."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.reconstruction.ground import Ground

LEAST = 1e-6  # alpha of what is there


@dataclass(frozen=True)
class Maps:
    """What lies over each cell. colour and height are of what is opaque there, 0 where nothing is."""

    colour: Float32[Array, "rows columns 3"]
    height: Float32[Array, "rows columns"]
    alpha: Float32[Array, "rows columns"]
    uncertainty: Float32[Array, "rows columns"]

    def known_colour(self) -> Float32[Array, "rows columns 3"]:
        """colour, NaN where nothing is."""
        return np.where(self.alpha[..., None] > LEAST, self.colour, np.float32(np.nan))


def over_exemplar(field: GaussianField, grid: Ground) -> Maps:
    """The maps of the exemplar's cells alone."""
    block = np.s_[grid.first_row : grid.first_row + grid.cells, grid.first_column : grid.first_column + grid.cells]
    return Maps(*(m[block] for m in vars(from_above(field, grid)).values()))


def from_above(field: GaussianField, grid: Ground) -> Maps:
    """Draw the field by an orthographic camera over the grid, from above its highest Gaussian."""
    rows, columns = grid.shape
    top = float(field.means[:, 2].max()) + 10 * grid.spacing
    camera = cameras.top_down(grid.west, grid.south, columns, rows, grid.spacing, top)
    raster = Rasterizer()
    seen = raster.forward(**to_raster_arrays(field), camera=camera)
    doubt = raster.forward(**to_raster_arrays(field, field.uncertainty[:, None]), camera=camera)
    solid = np.maximum(seen.alpha, LEAST)
    maps = Maps(
        seen.colour / solid[..., None],
        np.where(seen.alpha > LEAST, top - seen.depth / solid, 0),
        seen.alpha,
        np.clip(doubt.colour[..., 0] + 1 - seen.alpha, 0, 1),
    )
    return Maps(*(np.ascontiguousarray(m[::-1], np.float32) for m in vars(maps).values()))
