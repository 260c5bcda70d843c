"""The texture of an exemplar: its scale, the size of tiles for it, and the trends that are removed from it.

Where things on the ground are small, all of it looks alike, and a larger tile has less of its area along
seams. Where they are large there are few: tiles of half the exemplar would all show the same things.

A trend of brightness or height is a low-pass over the ground: a plane, and a Gaussian average of the
rest. The average is robust, since a shrub or a boulder is an object to keep: cells far from the mean of
their surroundings lose weight, and the average is taken again.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

from dav_gswt.field import SH0, GaussianField
from dav_gswt.tiles.layout import Exemplar

TREND = 0.1  # of the exemplar's side: what is wider is no texture
FARTHEST = 1 / 3  # of the exemplar's side that is measured: beyond it too few cells are compared
RELATED = 0.1  # correlation below which cells count as unrelated
# scales, as shares of the exemplar's side, between which tiles get smaller
SCALES = 0.017, 0.027
TILES = 0.5, 0.38
AROUND = 1.6  # half-width of a strip over the scale: a cut can go around what lies in it
ROUNDING = np.finfo(np.float32).eps ** 2  # variance of colours from 0 to 1 that is none
ROUNDS = 3  # of reweighting a trend
STEEP = 0.01  # slope of a trend below which a Gaussian's shape is left alone
STRIPS = 0.06, 0.125  # of a tile's side: narrower ones hardly hold a cut, wider ones are the same in too many tiles


def measure_texture_scale(colour: Float[Array, "m m c"]) -> float:
    """Radius in cells of a disc as large as the area over which colours correlate; 0 where all are the same.

    That area is 2 pi sum_d r(d) d with the autocorrelation r at a distance of d cells, in the mean over all directions,
    up to where it first falls below RELATED. (Noise blurred by s cells: r = exp(-d^2 / 4 s^2), a scale of 1.9 s.)
    """
    m = len(colour)
    residual = np.stack([v - gaussian_filter(v, TREND * m, mode="nearest") for v in np.moveaxis(colour, -1, 0)], -1)
    residual -= residual.mean((0, 1))
    pairs = _autocorrelate(np.ones((m, m, 1)))
    correlation = _autocorrelate(residual) / np.maximum(pairs, 1)
    lag = np.minimum(np.arange(2 * m), 2 * m - np.arange(2 * m))
    distances = np.rint(np.hypot(lag[:, None], lag)).astype(int).ravel()
    count = int(m * FARTHEST) + 1
    r = (np.bincount(distances, correlation.ravel()) / np.bincount(distances))[:count]
    if r[0] <= ROUNDING:
        return 0.0
    r /= r[0]
    end = np.argmax(r < RELATED) if (r < RELATED).any() else count
    return float(np.sqrt(2 * (r * np.arange(count))[:end].sum()))


def choose_sizes(scale: float) -> tuple[float, float]:
    """A tile's side over the exemplar's, and the half-width of its strips over the tile's, for a texture's scale over
    the exemplar's side."""
    tile = float(np.interp(scale, SCALES, TILES))
    return tile, float(np.clip(AROUND * scale / tile, *STRIPS))


def _autocorrelate(values: Float[Array, "m m c"]) -> Float[Array, "k k"]:
    """Sums of products of all cells that are so far apart (rows, columns; from 0, cyclic in twice the side)."""
    shape = (2 * values.shape[0], 2 * values.shape[1])
    spectrum = np.fft.rfft2(values, s=shape, axes=(0, 1))
    return np.fft.irfft2((np.abs(spectrum) ** 2).sum(-1), s=shape)


@dataclass(frozen=True)
class Trend:
    """Maps over the exemplar's finest cells, row 0 in the south: what to subtract from colours and heights."""

    exemplar: Exemplar
    colour: Float[Array, "m m 3"]
    height: Float[Array, "m m"]

    def at(self, points: Float[Array, "n d"]) -> tuple[Float[Array, "n 3"], Float[Array, "n"], Float[Array, "n 2"]]:
        """Colour, height and the height's slopes (east, north) at points, bilinear; constant beyond the border."""
        step = self.exemplar.spacing
        row = (points[:, 1] - self.exemplar.south) / step - 0.5
        column = (points[:, 0] - self.exemplar.west) / step - 0.5

        def sample(values: Array) -> Array:
            return map_coordinates(values, [row, column], order=1, mode="nearest")

        north, east = np.gradient(self.height, step)
        colour = np.stack([sample(self.colour[..., c]) for c in range(3)], 1)
        return colour, sample(self.height), np.stack([sample(east), sample(north)], 1)


def fit_low_pass(values: Float[Array, "m m"], known: Bool[Array, "m m"], width: float) -> Float[Array, "m m"]:
    """Plane plus robust Gaussian average (standard deviation `width` cells) of the known cells.

    The plane carries a slope right to the border, where a one-sided average would flatten it. Weights are
    1 / (1 + (r / scale)^2), with r the distance from the last average and scale twice its root mean square.
    """
    rows, columns = values.shape
    y, x = np.mgrid[-1 : 1 : rows * 1j, -1 : 1 : columns * 1j]
    base = np.stack([np.ones(values.size), x.ravel(), y.ravel()], 1)
    plane = (base @ np.linalg.lstsq(base[known.ravel()], values[known], rcond=None)[0]).reshape(values.shape)
    rest = np.where(known, values - plane, 0)
    weight, mean = known.astype(float), np.zeros_like(rest)
    for _ in range(ROUNDS):
        mass = gaussian_filter(weight, width, mode="constant", truncate=3.0)
        mean = gaussian_filter(weight * rest, width, mode="constant", truncate=3.0) / np.maximum(mass, 1e-12)
        away = np.where(known, rest - mean, 0)
        scale = 2 * np.sqrt((away**2).sum() / known.sum())
        weight = known / (1 + (away / scale) ** 2) if scale > 0 else known.astype(float)
    return plane + mean


def fit_trend(colour: Float[Array, "m m 3"], height: Float[Array, "m m"], exemplar: Exemplar, width: float) -> Trend:
    """The trend of an exemplar from its maps; NaN where a map has no value. Each part's mean is left to the field."""
    parts = []
    for values in (*np.moveaxis(colour, -1, 0), height):
        known = np.isfinite(values)
        filled = np.where(known, values, 0).astype(float)
        trend = fit_low_pass(filled, known, width) if known.any() else filled
        parts.append(trend - trend.mean())
    return Trend(exemplar, np.stack(parts[:3], -1).astype(np.float32), parts[3].astype(np.float32))


def remove_trend(field: GaussianField, trend: Trend) -> GaussianField:
    """The field without the trend: ground and what stands on it move and change colour alike; local relief stays.

    Gaussians follow the slope that is taken out (z' = z - h(x, y) shears their covariance), so that discs stay closed.
    """
    colour, height, slope = trend.at(field.means.astype(float))
    sh = field.sh.copy()
    sh[:, 0] -= (colour / SH0).astype(np.float32)
    means = field.means.copy()
    means[:, 2] -= height.astype(np.float32)
    return shear_covariances(replace(field, means=means, sh=sh), -slope)


def shear_covariances(field: GaussianField, slope: Float[Array, "n 2"]) -> GaussianField:
    """Covariances under z' = z + slope . (x, y), for the Gaussians whose slope matters (STEEP)."""
    steep = np.flatnonzero(np.linalg.norm(slope, axis=1) > STEEP)
    if not len(steep):
        return field
    axes = Rotation.from_quat(field.quats[steep].astype(float), scalar_first=True).as_matrix()
    half = axes * np.exp(field.log_scales[steep].astype(float))[:, None, :]
    half[:, 2] += np.einsum("nk,nkj->nj", slope[steep], half[:, :2])
    axes, size, _ = np.linalg.svd(half)  # of the root, not of the covariance: thin discs keep their thickness
    axes[np.linalg.det(axes) < 0, :, 2] *= -1
    log_scales, quats = field.log_scales.copy(), field.quats.copy()
    log_scales[steep] = np.log(np.maximum(size, 1e-12))
    quats[steep] = Rotation.from_matrix(axes).as_quat(scalar_first=True)
    return replace(field, log_scales=log_scales, quats=quats)
