"""Gaussians on shelves, from west to east: of the many of a tile, or of the exemplar, a crop shows few."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster.interface import RIM

SLOPES = 1.5  # how much more ground than where it is level a thing may hide behind it

Box = Float[Array, "2 2"]  # south-western and north-eastern corner, in world units


@dataclass(frozen=True)
class Seen:
    """The ground that a crop looks at, and how far a ray that hits level ground comes from per unit of height."""

    box: Box
    per_height: Float[Array, "2"]

    @classmethod
    def of(cls, camera: Camera, box: Box) -> "Seen":
        ahead = camera.forward
        return cls(box, ahead[:2] / abs(ahead[2]))

    def hidden(self, axis: int, low: Float[Array, "n"], high: Float[Array, "n"]) -> tuple[Float[Array, "n"], ...]:
        """From where to where along an axis, counted from their places, things between two heights may hide the ground.

        One at a height z hides it up to SLOPES times z per_height behind itself: on a slope up it is less, on a slope
        down more. A patch that is laid higher or lower as a whole takes its ground along.
        """
        far = SLOPES * self.per_height[axis]
        first, last = (far * low, far * high) if far > 0 else (far * high, far * low)
        return np.minimum(first, 0), np.maximum(last, 0)


@dataclass(frozen=True)
class Shelf:
    """A field, its Gaussians' numbers from west to east, and of each in that order: its place, how far it reaches from
    there at most, its lowest and highest point. most: the farthest reach, the lowest and the highest point of all.
    """

    field: GaussianField
    order: Int[Array, "n"]
    places: Float[Array, "2 n"]
    reach: Float[Array, "n"]
    low: Float[Array, "n"]
    high: Float[Array, "n"]
    most: tuple[float, float, float]

    @classmethod
    def of(cls, field: GaussianField) -> "Shelf":
        order = np.argsort(field.means[:, 0], kind="stable")
        means = field.means[order].astype(float)
        reach = RIM * np.exp(field.log_scales.max(1, initial=-np.inf)[order].astype(float))
        low, high = means[:, 2] - reach, means[:, 2] + reach
        most = reach.max(initial=0), low.min(initial=np.inf), high.max(initial=-np.inf)
        return cls(field, order, np.ascontiguousarray(means[:, :2].T), reach, low, high, tuple(float(v) for v in most))

    def near(self, seen: Seen, corner: Float[Array, "3"]) -> GaussianField:
        """Those that may show over the ground that is seen, counted from a corner; in the field's own order."""
        box = seen.box - corner[:2]
        some, shown = self._between(seen, *box[:, 0]), True
        for axis in (0, 1):
            low, high = seen.hidden(axis, self.low[some], self.high[some])
            places, reach = self.places[axis, some], self.reach[some]
            shown &= (places + reach + high > box[0, axis]) & (places - reach + low < box[1, axis])
        return self.field[np.sort(self.order[some][shown])]

    def _between(self, seen: Seen, west: float, east: float) -> slice:
        """Where on the shelf those stand that may show between west and east: by `most`."""
        widest, lowest, highest = self.most
        (low,), (high,) = seen.hidden(0, np.array([lowest]), np.array([highest]))
        first, last = west - high - widest, east - low + widest
        return slice(np.searchsorted(self.places[0], first), np.searchsorted(self.places[0], last, side="right"))
