"""What comes back with every tile: the part of a terrain that is periodic, and what a patch would add to it.

All tiles are laid equally often, so a terrain's average over its periods is the mean of the tiles' pictures, and the
variance of that mean over a tile, as a share of the ground's own, is the terrain's autocorrelation at the distance of
one tile. A lattice that the eye finds is nothing else. A landmark is no matter where few tiles have another at the same
place of theirs; what all show at one place is.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles.energy import scale

FINE = 64  # samples along a tile's side


@dataclass(frozen=True)
class Shown:
    """Pictures laid over one another. ground: the exemplar's, blurred to a sample's width, of mean 0 and variance 1
    over all its cells; sample: cells between two samples. total: sum of the patches so far at each sample of `inside`.
    """

    ground: Float[Array, "m m c"]
    sample: int
    inside: Bool[Array, "h w"]
    total: Float[Array, "k c"]

    def crop(self, place: Int[Array, "2"]) -> Float[Array, "k c"]:
        """What a patch at a place (x, y) shows."""
        x, y = place
        h, w = self.inside.shape
        s = self.sample
        return self.ground[y : y + h * s : s, x : x + w * s : s][self.inside]

    def charge(self, places: Int[Array, "n 2"]) -> Float[Array, "n"]:
        """How much more there would be of what comes back, per sample, with a patch at each place.

        sum |total + B|^2 - |total|^2 = sum 2 total B + B^2: of a patch alone its own variance, 1 on average.
        """
        crops = (self.crop(place) for place in places)
        return np.array([float((b * (2 * self.total + b)).sum(1).mean()) for b in crops])

    def plus(self, place: Int[Array, "2"], sign: int = 1) -> "Shown":
        """With a patch at that place; without it where the sign is -1."""
        return replace(self, total=self.total + sign * self.crop(place))


def nothing(colour: Float[Array, "m m c"], side: int, inside: Bool[Array, "h w"]) -> Shown:
    """No patch yet, of those that show the cells `inside` of a rectangle; `side` is the tile's, in cells."""
    sample = max(1, side // FINE)
    soft = np.stack([gaussian_filter(colour[..., c], sample, mode="nearest") for c in range(colour.shape[-1])], -1)
    soft -= soft.mean((0, 1))
    spread = float(np.sqrt((soft**2).sum(-1).mean()))
    h, w = (v // sample * sample for v in inside.shape)
    inside = inside[:h:sample, :w:sample]
    return Shown(soft / scale(spread), sample, inside, np.zeros((int(inside.sum()), colour.shape[-1])))
