"""Maps of an exemplar, one value a finest cell, row 0 in the south: what materials and objects are found by."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.field import GaussianField
from dav_gswt.reconstruction import top_view
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import build, occluders
from dav_gswt.tiles.layout import Exemplar

UNKNOWN = 0.9  # uncertainty from which nothing is known of a cell


@dataclass(frozen=True)
class GroundMaps:
    """Maps of an exemplar.

    Attributes:
        colour: seen from straight above, sRGB in [0, 1]; holes have the nearest cell's.
        height: of the ground discs.
        surface: height of what is seen from straight above: of the ground or of what stands on it.
        cover: share of a cell that is hidden by what stands there.
        known: cells that a photo saw.
        exemplar: its place and the width of its cells.
    """

    colour: Float[Array, "m m 3"]
    height: Float[Array, "m m"]
    surface: Float[Array, "m m"]
    cover: Float[Array, "m m"]
    known: Bool[Array, "m m"]
    exemplar: Exemplar

    @property
    def cells(self) -> int:
        return len(self.known)

    def crop(self, row: int, column: int, cells: int) -> "GroundMaps":
        """The maps of a square within the exemplar."""
        own, box = self.exemplar, np.s_[row : row + cells, column : column + cells]
        corner = own.west + column * own.spacing, own.south + row * own.spacing
        place = Exemplar(*corner, own.spacing, cells)
        colour, height, surface = self.colour[box], self.height[box], self.surface[box]
        return GroundMaps(colour, height, surface, self.cover[box], self.known[box], place)


def measure_ground(field: GaussianField, grid: Ground) -> GroundMaps:
    """The maps of a field's exemplar."""
    exemplar = Exemplar.from_grid(grid)
    above = top_view.render_exemplar(field, grid)
    _, height = build.compute_ground_maps(field, exemplar)
    known = (above.alpha > top_view.MIN_ALPHA) & (above.uncertainty < UNKNOWN) & np.isfinite(height)
    if not known.any():
        known = np.ones_like(known)
    nearest = tuple(distance_transform_edt(~known, return_distances=False, return_indices=True))
    height = np.nan_to_num(height[nearest].astype(float))
    colour = np.clip(above.colour[nearest].astype(float), 0, 1)
    surface = above.height[nearest].astype(float)
    return GroundMaps(colour, height, surface, occluders.compute_cover(field, exemplar, height), known, exemplar)
