"""What comes back with every tile: the part of a terrain that is periodic, and what a patch would add to it.

All tiles are laid equally often, so a terrain's average over its periods is the mean of the tiles' pictures, and the
variance of that mean over a tile, as a share of the ground's own, is the terrain's autocorrelation at the distance of
one tile. A lattice that the eye finds is nothing else. A landmark is no matter where few tiles have another at the same
place of theirs; what all show at one place is. Worst is what adds up to a line along a row or a column of tiles, such
as a bare strip: it goes on for ever, so the eye finds it where it is much weaker than anything else that comes back.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles.energy import scale

FINE = 64  # samples along a tile's side
# How much more lines cost than the rest of what comes back. (desert, flowers, grass, planet of seeds for development,
# in two dimensions: the strongest row of the mean tile falls from .29 .30 .30 .15 of the tiles' deviation to .19 .15
# .21 .12; with 16 to .16 .11 .21 .16, but then r a tile away rises by a sixth on grass and planet)
LINES = 4.0


@dataclass(frozen=True)
class Shown:
    """Pictures laid over one another. ground: the exemplar's, blurred to a sample's width, of mean 0 and variance 1
    over all its cells; sample: cells between two samples; side: samples along a tile. margin: cells (x, y) of a patch
    that are left out at each side. total: sum of the patches so far.
    """

    ground: Float[Array, "m m c"]
    sample: int
    side: int
    margin: tuple[int, int]
    total: Float[Array, "h w c"]

    def crop(self, place: Int[Array, "2"]) -> Float[Array, "h w c"]:
        """What a patch at a place (x, y) shows."""
        x, y = np.add(place, self.margin)
        h, w = self.total.shape[:2]
        s = self.sample
        return self.ground[y : y + h * s : s, x : x + w * s : s]

    def charge(self, places: Int[Array, "n 2"]) -> Float[Array, "n"]:
        """How much more there would be of what comes back, per sample, with a patch at each place.

        sum |total + B|^2 - |total|^2 - |B|^2 = 2 sum total B: a patch's own square is left out. Whatever it shows, that
        comes back as often as there are tiles like it; charged for, tiles would be blander than the ground. The squares
        of the means over a tile's rows and columns, LINES times, are charged in full: a line goes on by itself.
        """
        across, along = self._lines(self.total)

        def more(b: Float[Array, "h w c"]) -> float:
            rows, columns = self._lines(b)
            lines = ((2 * across + rows) * rows).sum() + ((2 * along + columns) * columns).sum()
            return float(((2 * self.total * b).sum() + LINES * self.side * lines) / (b.size / b.shape[-1]))

        return np.array([more(self.crop(place)) for place in places])

    def _lines(self, picture: Float[Array, "h w c"]) -> tuple[Float[Array, "h c"], Float[Array, "w c"]]:
        """Its part of the mean over each row and each column of a tile."""
        return picture.sum(1) / self.side, picture.sum(0) / self.side

    def plus(self, place: Int[Array, "2"], sign: int = 1) -> "Shown":
        """With a patch at that place; without it where the sign is -1."""
        return replace(self, total=self.total + sign * self.crop(place))


def nothing(colour: Float[Array, "m m c"], side: int, size: tuple[int, int], margin: tuple[int, int] = (0, 0)) -> Shown:
    """No patch yet, of those of a size (width, height) of which a margin at each side does not show.

    side: the tile's, in cells.
    """
    sample = max(1, side // FINE)
    soft = np.stack([gaussian_filter(colour[..., c], sample, mode="nearest") for c in range(colour.shape[-1])], -1)
    soft -= soft.mean((0, 1))
    spread = float(np.sqrt((soft**2).sum(-1).mean()))
    w, h = (max(1, (whole - 2 * left) // sample) for whole, left in zip(size, margin, strict=True))
    total = np.zeros((h, w, colour.shape[-1]))
    return Shown(soft / scale(spread), sample, max(1, side // sample), margin, total)
