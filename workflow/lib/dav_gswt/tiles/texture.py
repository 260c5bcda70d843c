"""The scale of a ground's texture, the size of tiles for it, and whether it has a pattern.

Where objects on the ground are small, all of it looks alike, and a larger tile has less of its area along seams. Where
they are large there are few: tiles of half the exemplar would all show the same ones, in rows when seen from above.
Smaller tiles have more places to choose from.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

TREND = 0.1  # of the exemplar's side: what is wider is no texture
FARTHEST = 1 / 3  # of the exemplar's side that is measured: beyond it too few cells are compared
RELATED = 0.1  # correlation below which cells count as unrelated
FAR = 0.2  # of the exemplar's side from which on only a regular pattern correlates
REGULAR = 0.2  # 27 exemplars of ten scenes without a pattern have at most 0.13, one of brick has 0.43
CHANCE = 8.0  # times the scale over the side: noise reaches 7 (60 pictures of five scales)
# scales, as shares of the exemplar's side, between which tiles get smaller
SCALES = 0.017, 0.027
TILES = 0.5, 0.38
AROUND = 1.6  # half-width of a strip over the scale: a cut can go around what lies in it
ROUNDING = np.finfo(np.float32).eps ** 2  # variance of colours from 0 to 1 that is none
STRIPS = 0.06, 0.125  # of a tile's side: narrower ones hardly hold a cut, wider ones are the same in too many tiles


def measure_texture_scale(colour: Float[Array, "m m c"]) -> float:
    """Radius in cells of a disc as large as the area over which colours correlate; 0 where all are the same.

    That area is 2 pi sum_d r(d) d with the autocorrelation r at a distance of d cells, in the mean over all directions,
    up to where it first falls below RELATED. (Noise blurred by s cells: r = exp(-d^2 / 4 s^2), a scale of 1.9 s.)
    """
    return _measure_scale(*_correlate(colour))


def measure_pattern(colour: Float[Array, "m m c"]) -> float | None:
    """Correlation of a ground's regular pattern, such as courses of brick, furrows or a bold line; None without one.

    The highest autocorrelation from FAR to FARTHEST of the side, in any direction, if it is above REGULAR and above
    what noise of the ground's own scale reaches by chance.
    """
    m = len(colour)
    correlation, distance = _correlate(colour)
    if correlation[0, 0] <= ROUNDING:
        return None
    counted = (distance >= FAR * m) & (distance <= FARTHEST * m)
    highest = float(correlation[counted].max() / correlation[0, 0])
    by_chance = CHANCE * _measure_scale(correlation, distance) / m
    return highest if highest > max(REGULAR, by_chance) else None


def choose_sizes(scale: float) -> tuple[float, float]:
    """A tile's side over the exemplar's, and the half-width of its strips over the tile's, for a texture's scale over
    the exemplar's side."""
    tile = float(np.interp(scale, SCALES, TILES))
    return tile, float(np.clip(AROUND * scale / tile, *STRIPS))


def _measure_scale(correlation: Float[Array, "k k"], distance: Float[Array, "k k"]) -> float:
    """`measure_texture_scale` of what `_correlate` gives."""
    distances = np.rint(distance).astype(int).ravel()
    count = int(len(correlation) // 2 * FARTHEST) + 1
    r = (np.bincount(distances, correlation.ravel()) / np.bincount(distances))[:count]
    if r[0] <= ROUNDING:
        return 0.0
    r /= r[0]
    end = np.argmax(r < RELATED) if (r < RELATED).any() else count
    return float(np.sqrt(2 * (r * np.arange(count))[:end].sum()))


def _correlate(colour: Float[Array, "m m c"]) -> tuple[Float[Array, "k k"], Float[Array, "k k"]]:
    """Mean products of colours without their trend at all lags, as `_autocorrelate`, and the lags' lengths in cells."""
    m = len(colour)
    residual = np.stack([v - gaussian_filter(v, TREND * m, mode="nearest") for v in np.moveaxis(colour, -1, 0)], -1)
    residual -= residual.mean((0, 1))
    x = np.minimum(np.arange(2 * m), 2 * m - np.arange(2 * m))
    pairs = _autocorrelate(np.ones((m, m, 1)))
    return _autocorrelate(residual) / np.maximum(pairs, 1), np.hypot(x[:, None], x)


def _autocorrelate(values: Float[Array, "m m c"]) -> Float[Array, "k k"]:
    """Sums of products of all cells that are so far apart (rows, columns; from 0, cyclic in twice the side)."""
    shape = (2 * values.shape[0], 2 * values.shape[1])
    spectrum = np.fft.rfft2(values, s=shape, axes=(0, 1))
    return np.fft.irfft2((np.abs(spectrum) ** 2).sum(-1), s=shape)
