"""Variation of the place: large-scale light and dark, which tiles lack since a trend is taken out of their exemplar.

It is gradient noise of the place, a colour a material, added to the colours of Gaussians in sRGB; `fit_variation` gives
it the exemplar's own statistics. All levels of a cell vary alike, and an object as the ground at its foot. Heights do
not vary. The viewer's `terrain/variation.js` and its shader compute the same; tests/golden/heights.json holds them
to it.

What is fitted is the power that an exemplar has on a large scale and its tiles have not. Power is measured in square
windows of half the exemplar's side: first that of the plane through each, which is all that is wider, then by octaves
of wavelength down to half a tile, without the plane and by a Hann window. The exemplar loses its mean before. Terrain
and noise are cut into squares as large as the exemplar and measured alike, so windows change all spectra alike. The
amplitudes of the waves solve a least-squares problem over octaves: (terrain + noise) / exemplar is to be 1. Where tiles
have power themselves, only what is missing is added.

Colours vary along one axis, the main one of the exemplar's large scale: on photographed grounds the second one has a
third of its amplitude at most. A bright blob is no statistic: along the axis, large-scale values are cut.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter
from scipy.optimize import nnls

from dav_gswt.bundle.land_cover import WaveEntry
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.raster import render
from dav_gswt.terrain.choice import Floats, tiles_at
from dav_gswt.terrain.classes import TURN
from dav_gswt.terrain.heights import SHIFT, gradient_noise
from dav_gswt.tiles import layout
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.compose import BinnedLevel

VARIATION = 104  # axis of the hash: wave k uses VARIATION + k
WAVELENGTHS = 0.63, 1.57  # tile sides: widths of noise's cells. Its power is greatest at 1.6 times that
WIDE = 0.1  # tile sides: blur of what counts as large scale
FARTHEST = 2.5  # robust standard deviations at which large-scale values are cut
SIDE = 12  # tiles along a terrain that is measured, at least
FINE = 32  # cells along a tile's side that are measured, at least: half a tile is the finest scale
WINDOWS = 5  # along a square as large as the exemplar
EVERY = slice(None)
LEAST, FAINT = 1e-9, 0.01  # power that is rounding; of an exemplar's strongest octave: fainter ones count for nothing
DIGITS = 5  # of amplitudes


@dataclass(frozen=True)
class Variation:
    """The variation of a terrain.

    Attributes:
        waves: of the manifest.
        side: of a tile.
        salt: of the terrain.
    """

    waves: Sequence[WaveEntry]
    side: float
    salt: int

    def at(self, x: Floats, y: Floats, material: int | Int[Array, "n"]) -> Float[Array, "n 3"]:
        """What is added to red, green and blue at points of the world."""
        change = np.zeros((len(x), 3))
        for k, wave in enumerate(self.waves):
            x, y = TURN[0] * x - TURN[1] * y, TURN[1] * x + TURN[0] * y
            noise = make_wave(x, y, k, wave.wavelength * self.side, self.salt)
            change += noise[:, None] * np.array(wave.colours)[material]
        return change


def make_wave(x: Float[Array, "*n"], y: Float[Array, "*n"], number: int, width: float, salt: int) -> Float[Array, "*n"]:
    """Noise in cells of a width, at points in the wave's own axes; |noise| <= 1, its standard deviation about 0.18."""
    noise, _ = gradient_noise(x / width + number * SHIFT[0], y / width + number * SHIFT[1], VARIATION + number, salt)
    return noise


def tint_field(field: GaussianField, change: Float[Array, "n 3"]) -> GaussianField:
    """The field with other colours, cut at 0 and 1."""
    sh = field.sh.copy()
    sh[:, 0] = rgb_to_sh(np.clip(field.base_colours + change, 0, 1).astype(np.float32))[:, 0]
    return replace(field, sh=sh)


def fit_variation(tiles: Sequence[TileSet], factor: float, salt: int, across: slice = EVERY) -> list[WaveEntry] | None:
    """The waves of all materials, times a factor; None: nothing is missing, or it is not known what the tiles lack.

    Args:   salt: of the terrain that is measured. across: the exemplar's windows that count, of WINDOWS from the west.
    """
    if factor <= 0 or any(own.recipe is None for own in tiles):
        return None
    colours = np.array([factor * _fit_waves(own, salt, across) for own in tiles])
    colours = np.round(colours / np.maximum(1, np.abs(colours).max(-1, keepdims=True)), DIGITS)
    waves = zip(WAVELENGTHS, np.moveaxis(colours, 1, 0), strict=True)
    return [WaveEntry(width, each.tolist()) for width, each in waves if each.any()] or None


def _fit_waves(tiles: TileSet, salt: int, across: slice) -> Float[Array, "waves 3"]:
    """Colour of each wave for a material: of noise 1."""
    exemplar, pieces = map_colours(tiles)
    cells, side = len(exemplar), pieces.shape[1]
    axis, wanted = find_axis(exemplar, WIDE * side)
    count = max(SIDE, -(-cells // side))
    terrain = _lay_out(pieces @ axis, tiles.variants, salt, count)
    y, x = (np.mgrid[: count * side, : count * side] + 0.5) / side
    noises = [make_wave(x, y, k, width, salt) for k, width in enumerate(WAVELENGTHS)]
    target = measure_octaves(wanted, cells, side, across)
    own, *gains = (measure_octaves(values, cells, side) for values in (terrain, *noises))
    known = target > max(LEAST, FAINT * target.max())
    shares, missing = (values[..., known] / target[known] for values in (np.array(gains), target - own))
    power = nnls(shares.T, missing)[0]
    return np.sqrt(power)[:, None] * axis


def map_colours(tiles: TileSet) -> tuple[Float[Array, "m m 3"], Float[Array, "t n n 3"]]:
    """The exemplar with its trend, and each tile, from straight above, in cells of which a tile has FINE or more."""
    recipe = tiles.recipe
    assert recipe is not None
    flat, trend, side = _see_flat(recipe.levels[0]), recipe.trend.colour, tiles.layout.side
    cell = max(each for each in range(1, max(1, side // FINE) + 1) if side % each == 0)
    pieces = [
        _shrink(flat[layout.source_cells(own, shift)] + correction[..., :3], cell)
        for own, shift, correction in zip(tiles.labels, tiles.shifts, recipe.corrections, strict=True)
    ]
    return _shrink(flat + trend, cell), np.array(pieces)


def _see_flat(level: BinnedLevel) -> Float[Array, "m m 3"]:
    """The exemplar without its trend; a hole has the mean colour."""
    step, cells, (west, south) = level.exemplar.spacing, level.cells, (level.exemplar.west, level.exemplar.south)
    top = float(level.field.means[:, 2].max()) + 10 * step
    seen = render(level.field, cameras.top_down(west, south, cells, cells, step, top))
    known = seen.alpha > 0.5
    colour = seen.colour / np.maximum(seen.alpha, 0.5)[..., None]
    mean = colour[known].mean(0) if known.any() else 0.0
    return np.where(known[..., None], colour, mean)[::-1].astype(float)


def _shrink(values: Float[Array, "h w c"], cell: int) -> Float[Array, "h1 w1 c"]:
    """Means of whole cells that are so many times as wide."""
    rows, columns = (n // cell for n in values.shape[:2])
    whole = values[: rows * cell, : columns * cell]
    return whole.reshape(rows, cell, columns, cell, -1).mean((1, 3))


def find_axis(colour: Float[Array, "m m 3"], width: float) -> tuple[Float[Array, "3"], Float[Array, "m m"]]:
    """The main axis of a map's large scale, and the map along it, its large scale cut. width: of the blur, in cells."""
    wide = np.stack([gaussian_filter(colour[..., c], width, mode="nearest") for c in range(3)], -1)
    wide -= np.median(wide, (0, 1))
    axis = np.linalg.eigh(np.cov(wide.reshape(-1, 3).T))[1][:, -1]
    axis *= np.sign(axis.sum()) or 1.0
    along = wide @ axis
    most = FARTHEST * 1.4826 * float(np.median(np.abs(along)))
    return axis, colour @ axis - (along - np.clip(along, -most, most))


def _lay_out(pieces: Float[Array, "t n n"], variants: int, salt: int, count: int) -> Float[Array, "h w"]:
    """A terrain of `count` x `count` tiles, from its south-western cell."""
    j, i = np.mgrid[:count, :count]
    return np.concatenate([np.concatenate(row, 1) for row in pieces[tiles_at(i, j, salt, variants)]])


def measure_octaves(
    values: Float[Array, "h w"], cells: int, side: int, across: slice = EVERY
) -> Float[Array, "octaves"]:
    """Power of a map in octaves of wavelength, the widest first: what each adds to the variance in a window, in the
    mean over windows in all whole squares of `cells` x `cells`. side: of a tile, in cells. across: as `fit_variation`.
    """
    size = cells // 2
    y, x = (v.ravel() for v in np.mgrid[:size, :size])
    base = np.linalg.qr(np.stack([np.ones(size**2), x, y], 1))[0]
    window = np.outer(*2 * [np.sin(np.pi * (np.arange(size) + 0.5) / size) ** 2])
    window /= np.sqrt((window**2).mean())
    periods = np.hypot(*np.meshgrid(*2 * [np.fft.fftfreq(size) * size]))  # along a window
    count = max(1, int(np.ceil(np.log2(min(2 * size / side, size / 2)))))
    octave = np.digitize(periods, 2.0 ** np.arange(count + 1)).ravel()  # 0: none; count + 1: finer
    places, powers = np.linspace(0, cells - size, WINDOWS).astype(int), []
    for top in range(0, values.shape[0] - cells + 1, cells):
        for left in range(0, values.shape[1] - cells + 1, cells):
            square = values[top : top + cells, left : left + cells]
            square = square - square.mean()
            parts = np.array([square[j : j + size, i : i + size].ravel() for j in places for i in places[across]])
            planes = parts @ base @ base.T
            rest = np.fft.fft2((parts - planes).reshape(-1, size, size) * window)
            power = np.bincount(octave, (np.abs(rest) ** 2).mean(0).ravel() / size**4, count + 2)
            powers.append([(planes**2).mean(), *power[1 : count + 1]])
    return np.mean(powers, 0)
