"""Gaussians on shelves, from west to east: of the many of a tile, or of the exemplar, a crop shows few."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.field import Field
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

    def hidden(
        self, low: Float[Array, "n"], high: Float[Array, "n"]
    ) -> tuple[Float[Array, "n 2"], Float[Array, "n 2"]]:
        """From where to where, counted from their places, things between two heights may hide the ground.

        One at a height z hides it up to SLOPES times z per_height behind itself: on a slope up it is less, on a slope
        down more. A patch that is laid higher or lower as a whole takes its ground along.
        """
        behind = [SLOPES * z[:, None] * self.per_height for z in (low, high)]
        return np.minimum(np.minimum(*behind), 0), np.maximum(np.maximum(*behind), 0)


@dataclass(frozen=True)
class Shelf:
    """A field, its Gaussians' numbers from west to east, and of each in that order: its place, how far it reaches from
    there at most, its lowest and highest point. most: the farthest reach, the lowest and the highest point of all.
    """

    field: Field
    order: Int[Array, "n"]
    places: Float[Array, "n 2"]
    reach: Float[Array, "n"]
    low: Float[Array, "n"]
    high: Float[Array, "n"]
    most: tuple[float, float, float]

    @classmethod
    def of(cls, field: Field) -> "Shelf":
        order = np.argsort(field.means[:, 0], kind="stable")
        means = field.means[order].astype(float)
        reach = RIM * np.exp(field.log_scales.max(1, initial=-np.inf)[order].astype(float))
        low, high = means[:, 2] - reach, means[:, 2] + reach
        most = reach.max(initial=0), low.min(initial=np.inf), high.max(initial=-np.inf)
        return cls(field, order, means[:, :2], reach, low, high, tuple(float(v) for v in most))

    def near(self, seen: Seen, corner: Float[Array, "3"]) -> Field:
        """Those that may show over the ground that is seen, counted from a corner; in the field's own order."""
        box = seen.box - corner[:2]
        some = self._between(seen, *box[:, 0])
        low, high = seen.hidden(self.low[some], self.high[some])
        places, reach = self.places[some], self.reach[some, None]
        shown = ((places + reach + high > box[0]) & (places - reach + low < box[1])).all(1)
        return self.field[np.sort(self.order[some][shown])]

    def _between(self, seen: Seen, west: float, east: float) -> slice:
        """Where on the shelf those stand that may show between west and east: by `most`."""
        widest, lowest, highest = self.most
        (low,), (high,) = seen.hidden(np.array([lowest]), np.array([highest]))
        first, last = west - high[0] - widest, east - low[0] + widest
        return slice(np.searchsorted(self.places[:, 0], first), np.searchsorted(self.places[:, 0], last, side="right"))
