"""What comes back with every tile: the part of a terrain that is periodic, and what a patch would add to it.

All tiles are laid equally often, so a terrain's average over its periods is the mean of the tiles' pictures, and the
variance of that mean over a tile, as a share of the ground's own, is the terrain's autocorrelation at the distance of
one tile. A lattice that the eye finds is nothing else. A landmark is no matter where few tiles have another at the same
place of theirs; what all show at one place is. Worst is what adds up to a line along a row or a column of tiles, such
as a bare strip: it goes on for ever, so the eye finds it where it is much weaker than anything else that comes back.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles.energy import safe_unit

SAMPLES = 64  # samples along a tile's side
# How much more lines cost than the rest of what comes back. (desert, flowers, grass, planet of seeds for development,
# in two dimensions: the strongest row of the mean tile falls from .29 .30 .30 .15 of the tiles' deviation to .19 .15
# .21 .12; with 16 to .16 .11 .21 .16, but then r a tile away rises by a sixth on grass and planet)
LINE_WEIGHT = 4.0


@dataclass(frozen=True)
class OverlaidPatches:
    """Pictures laid over one another. ground: the exemplar's, blurred to a sample's width, of mean 0 and variance 1
    over all its cells; sample: cells between two samples; side: samples along a tile. margin: cells (x, y) of a patch
    that are left out at each side. total: sum of the patches so far. fast: what lies over any patch of these, NaN
    where the patch shows; left out: nothing does.
    """

    ground: Float[Array, "m m c"]
    sample: int
    side: int
    margin: tuple[int, int]
    total: Float[Array, "h w c"]
    fast: Float[Array, "h w c"] | None = None

    def crop(self, place: Int[Array, "2"]) -> Float[Array, "h w c"]:
        """What a patch at a place (x, y) shows."""
        x, y = np.add(place, self.margin)
        h, w = self.total.shape[:2]
        s = self.sample
        patch = self.ground[y : y + h * s : s, x : x + w * s : s]
        return patch if self.fast is None else np.where(np.isnan(self.fast), patch, self.fast)

    def cost_of(self, places: Int[Array, "n 2"]) -> Float[Array, "n"]:
        """How much more there would be of what comes back, per sample, with a patch at each place.

        sum |total + B|^2 - |total|^2 - |B|^2 = 2 sum total B: a patch's own square is left out. Whatever it shows, that
        comes back as often as there are tiles like it; charged for, tiles would be blander than the ground. The squares
        of the means over a tile's rows and columns, LINES times, are charged in full: a line goes on by itself.
        """
        across, along = self._lines(self.total)

        def more(b: Float[Array, "h w c"]) -> float:
            rows, columns = self._lines(b)
            lines = ((2 * across + rows) * rows).sum() + ((2 * along + columns) * columns).sum()
            return float(((2 * self.total * b).sum() + LINE_WEIGHT * self.side * lines) / (b.size / b.shape[-1]))

        return np.array([more(self.crop(place)) for place in places])

    def pair_costs(self, places: Int[Array, "n 2"]) -> Float[Array, "n n"]:
        """The charge for patches at each two places together, where no other comes back: 2 sum B B' and the lines of
        B + B'.

        So one makes good what the other lacks, where the first chosen for itself would leave the second what is left.
        (desert, flowers of seeds for development, against that: what comes back falls from .033, .064 of the colour's
        variance to .030, .058, the strongest column of the mean tile from .19, .16 of its deviation to .16, .12)
        """
        crops = np.stack([self.crop(place) for place in places])
        along, across = (crops.sum(axis) / self.side for axis in (1, 2))
        lines = _square_sums(along) + _square_sums(across)
        flat = crops.reshape(len(places), -1)
        return (2 * flat @ flat.T + LINE_WEIGHT * self.side * lines) / (flat.shape[1] / crops.shape[-1])

    def _lines(self, picture: Float[Array, "h w c"]) -> tuple[Float[Array, "h c"], Float[Array, "w c"]]:
        """Its part of the mean over each row and each column of a tile."""
        return picture.sum(1) / self.side, picture.sum(0) / self.side

    def with_patch(self, place: Int[Array, "2"]) -> "OverlaidPatches":
        """With a patch at that place."""
        return replace(self, total=self.total + self.crop(place))


def _square_sums(pictures: Float[Array, "n k c"]) -> Float[Array, "n n"]:
    """Squares of the sums of each two pictures."""
    flat = pictures.reshape(len(pictures), -1)
    products = flat @ flat.T
    own = np.diag(products)
    return own[:, None] + own[None] + 2 * products


def start_overlay(
    colour: Float[Array, "m m c"],
    side: int,
    size: tuple[int, int],
    margin: tuple[int, int] = (0, 0),
    fast: tuple[Bool[Array, "h w"], tuple[Array, Array]] | None = None,
) -> OverlaidPatches:
    """No patch yet, of those of a size (width, height) of which a margin at each side does not show.

    side: the tile's, in cells. fast: where something lies over the patches, and the exemplar's cells (rows, columns)
    that show there; of patches without a margin.
    """
    sample = max(1, side // SAMPLES)
    soft = np.stack([gaussian_filter(colour[..., c], sample, mode="nearest") for c in range(colour.shape[-1])], -1)
    soft -= soft.mean((0, 1))
    spread = float(np.sqrt((soft**2).sum(-1).mean()))
    w, h = (max(1, (whole - 2 * left) // sample) for whole, left in zip(size, margin, strict=True))
    ground, total = soft / safe_unit(spread), np.zeros((h, w, colour.shape[-1]))
    lies = None
    if fast:
        over, rows, columns = (v[::sample, ::sample][:h, :w] for v in (fast[0], *fast[1]))
        lies = np.where(over[..., None], ground[rows, columns], np.nan)
    return OverlaidPatches(ground, sample, max(1, side // sample), margin, total, lies)
