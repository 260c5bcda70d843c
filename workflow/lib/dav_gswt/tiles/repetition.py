"""Repetition: the periodic part of a terrain, and what a patch would add to it.

All tiles are placed equally often, so a terrain's average over its periods is the mean of the tiles' pictures. The
variance of that mean over a tile, as a share of the ground's own variance, is the terrain's autocorrelation at the
distance of one tile: a visible lattice. A landmark does not matter if few tiles have another at the same place; what
all tiles show at one place does. Lines along a row or a column of tiles, such as a bare strip, are the worst: they
continue through the whole terrain, so they are visible even where they are faint.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles.energy import safe_unit

SAMPLES = 64  # samples along a tile's side
LINE_WEIGHT = 4.0  # cost of lines over the cost of other repetition


@dataclass(frozen=True)
class OverlaidPatches:
    """The sum of patches that lie at the same place of their tiles.

    Attributes:
        ground: the exemplar's colours, blurred to a sample's width, of mean 0 and variance 1 over all its cells.
        sample: cells between two samples.
        side: samples along a tile.
        margin: cells (x, y) of a patch that are left out at each side.
        total: sum of the patches so far.
        cover: colours that lie over any of these patches, NaN where the patch is visible; None: nothing does.
    """

    ground: Float[Array, "m m c"]
    sample: int
    side: int
    margin: tuple[int, int]
    total: Float[Array, "h w c"]
    cover: Float[Array, "h w c"] | None = None

    def crop(self, place: Int[Array, "2"]) -> Float[Array, "h w c"]:
        """The samples of a patch at a place (x, y)."""
        x, y = np.add(place, self.margin)
        h, w = self.total.shape[:2]
        s = self.sample
        patch = self.ground[y : y + h * s : s, x : x + w * s : s]
        return patch if self.cover is None else np.where(np.isnan(self.cover), patch, self.cover)

    def compute_costs(self, places: Int[Array, "n 2"]) -> Float[Array, "n"]:
        """Added repetition, per sample, of a patch at each place.

        sum |total + B|^2 - |total|^2 - |B|^2 = 2 sum total B: a patch's own square is left out, or tiles would be
        plainer than the ground. The squares of the means over a tile's rows and columns, LINE_WEIGHT times, are charged
        in full: a line continues in the next tile.
        """
        across, along = self._average_lines(self.total)

        def added_cost(b: Float[Array, "h w c"]) -> float:
            rows, columns = self._average_lines(b)
            lines = ((2 * across + rows) * rows).sum() + ((2 * along + columns) * columns).sum()
            return float(((2 * self.total * b).sum() + LINE_WEIGHT * self.side * lines) / (b.size / b.shape[-1]))

        return np.array([added_cost(self.crop(place)) for place in places])

    def compute_pair_costs(self, places: Int[Array, "n 2"]) -> Float[Array, "n n"]:
        """Repetition of patches at each two places together, without any other: 2 sum B B' and the lines of B + B'.

        Two patches chosen as a pair complement one another; chosen one after the other, the second takes what is left.
        """
        crops = np.stack([self.crop(place) for place in places])
        along, across = (crops.sum(axis) / self.side for axis in (1, 2))
        lines = _square_sums(along) + _square_sums(across)
        flat = crops.reshape(len(places), -1)
        return (2 * flat @ flat.T + LINE_WEIGHT * self.side * lines) / (flat.shape[1] / crops.shape[-1])

    def _average_lines(self, picture: Float[Array, "h w c"]) -> tuple[Float[Array, "h c"], Float[Array, "w c"]]:
        """A picture's part of the mean over each row and each column of a tile."""
        return picture.sum(1) / self.side, picture.sum(0) / self.side

    def with_patch(self, place: Int[Array, "2"]) -> "OverlaidPatches":
        """The overlay with one more patch, at that place."""
        return replace(self, total=self.total + self.crop(place))


def _square_sums(pictures: Float[Array, "n k c"]) -> Float[Array, "n n"]:
    """Squared norm of the sum of each two pictures."""
    flat = pictures.reshape(len(pictures), -1)
    products = flat @ flat.T
    own = np.diag(products)
    return own[:, None] + own[None] + 2 * products


def start_overlay(
    colour: Float[Array, "m m c"],
    side: int,
    size: tuple[int, int],
    margin: tuple[int, int] = (0, 0),
    cover: tuple[Bool[Array, "h w"], tuple[Array, Array]] | None = None,
) -> OverlaidPatches:
    """An overlay without any patch yet, for patches of a size (width, height) with a hidden margin at each side.

    side: the tile's, in cells. cover: where something lies over the patches, and the exemplar's cells (rows, columns)
    that are visible there; only for patches without a margin.
    """
    sample = max(1, side // SAMPLES)
    soft = np.stack([gaussian_filter(colour[..., c], sample, mode="nearest") for c in range(colour.shape[-1])], -1)
    soft -= soft.mean((0, 1))
    spread = float(np.sqrt((soft**2).sum(-1).mean()))
    w, h = (max(1, (whole - 2 * left) // sample) for whole, left in zip(size, margin, strict=True))
    ground, total = soft / safe_unit(spread), np.zeros((h, w, colour.shape[-1]))
    cover_colours = None
    if cover:
        over, rows, columns = (v[::sample, ::sample][:h, :w] for v in (cover[0], *cover[1]))
        cover_colours = np.where(over[..., None], ground[rows, columns], np.nan)
    return OverlaidPatches(ground, sample, max(1, side // sample), margin, total, cover_colours)
