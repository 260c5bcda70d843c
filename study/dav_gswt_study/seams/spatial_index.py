"""Spatial index of the Gaussians of a tile or of the exemplar: a crop shows few of them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster.interface import RIM

MAX_SLOPE = 1.5  # ground that an object may hide behind it, over what it hides on level ground

Box = Float[Array, "2 2"]  # south-western and north-eastern corner, in world units


@dataclass(frozen=True)
class Footprint:
    """The ground under a crop, and the horizontal way of a viewing ray per unit of height."""

    box: Box
    per_height: Float[Array, "2"]

    @classmethod
    def from_camera(cls, camera: Camera, box: Box) -> "Footprint":
        ahead = camera.forward
        return cls(box, ahead[:2] / abs(ahead[2]))

    def occlusion_range(
        self, axis: int, low: Float[Array, "n"], high: Float[Array, "n"]
    ) -> tuple[Float[Array, "n"], ...]:
        """Interval along an axis, relative to their places, in which objects between two heights may hide the ground.

        An object at height z hides it up to MAX_SLOPE z per_height behind itself: less on a slope up, more on a slope
        down. A patch that is placed higher or lower as a whole takes its ground along.
        """
        offset = MAX_SLOPE * self.per_height[axis]
        first, last = (offset * low, offset * high) if offset > 0 else (offset * high, offset * low)
        return np.minimum(first, 0), np.maximum(last, 0)


@dataclass(frozen=True)
class SpatialIndex:
    """A field with its Gaussians sorted from west to east.

    order: their numbers in the field. Of each in that order: its place, its largest radius (`reach`), its lowest and
    highest point. max_extent: the largest radius, the lowest and the highest point of all.
    """

    field: GaussianField
    order: Int[Array, "n"]
    places: Float[Array, "2 n"]
    reach: Float[Array, "n"]
    low: Float[Array, "n"]
    high: Float[Array, "n"]
    max_extent: tuple[float, float, float]

    @classmethod
    def from_field(cls, field: GaussianField) -> "SpatialIndex":
        order = np.argsort(field.means[:, 0], kind="stable")
        means = field.means[order].astype(float)
        reach = RIM * np.exp(field.log_scales.max(1, initial=-np.inf)[order].astype(float))
        low, high = means[:, 2] - reach, means[:, 2] + reach
        max_extent = reach.max(initial=0), low.min(initial=np.inf), high.max(initial=-np.inf)
        return cls(
            field,
            order,
            np.ascontiguousarray(means[:, :2].T),
            reach,
            low,
            high,
            (float(max_extent[0]), float(max_extent[1]), float(max_extent[2])),
        )

    def query(self, footprint: Footprint, corner: Float[Array, "3"]) -> GaussianField:
        """Gaussians that may be visible over a footprint, with the field's origin at `corner`, in the field's order."""
        box = footprint.box - corner[:2]
        columns, visible = self._query_columns(footprint, *box[:, 0]), True
        for axis in (0, 1):
            low, high = footprint.occlusion_range(axis, self.low[columns], self.high[columns])
            places, reach = self.places[axis, columns], self.reach[columns]
            visible &= (places + reach + high > box[0, axis]) & (places - reach + low < box[1, axis])
        return self.field[np.sort(self.order[columns][visible])]

    def _query_columns(self, footprint: Footprint, west: float, east: float) -> slice:
        """The slice of the order that may be visible between west and east, by `max_extent`."""
        widest, lowest, highest = self.max_extent
        (low,), (high,) = footprint.occlusion_range(0, np.array([lowest]), np.array([highest]))
        first, last = west - high - widest, east - low + widest
        return slice(np.searchsorted(self.places[0], first), np.searchsorted(self.places[0], last, side="right"))
