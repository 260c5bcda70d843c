"""Height fields: height and slope of the terrain's surface at any point.

The viewer's `terrain/heights.js` computes the same numbers; tests/golden/heights.json holds both to them. Only
sums, products, quotients and floor of float64 are used, in the order written here.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Float32, Int64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import locate_path
from dav_gswt.images import image_files
from dav_gswt.terrain.choice import hash_cell
from dav_gswt.terrain.sphere import make_sphere

HILLS = 3  # axis of the hash of octave 0, after west, south and centre; octave k uses HILLS + k
GAIN = 0.4  # height of an octave over that of the one twice as wide
SHIFT = (0.37, 0.71)  # of each octave against the last, in its own cells; else all are 0 at the corners of the first
STEEPEST = 2.75  # upper bound of the slope of the noise, per cell, over all gradients at the corners
FARTHEST = 1e9  # units from 0 to a height: more is refused by the page too
BLOCK = 4096  # points whose noise is computed at once: their intermediate values stay in the cache
MAX_SIDE = 4096  # pixels along a side of a height map: every WebGL2 device in use takes textures of this size


@runtime_checkable
class HeightField(Protocol):
    """A surface z = h(x, y), once differentiable, over the whole plane.

    low, high: bounds of h. steepest: upper bound of the length of h's gradient.
    """

    @property
    def low(self) -> float: ...

    @property
    def high(self) -> float: ...

    @property
    def steepest(self) -> float: ...

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        """h and its derivatives by x and y at points of the world."""
        ...


@dataclass(frozen=True)
class FlatSurface:
    """h = 0."""

    low: float = 0.0
    high: float = 0.0
    steepest: float = 0.0

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        return np.zeros(len(x)), np.zeros((len(x), 2))


@dataclass(frozen=True)
class Hills:
    """Gradient noise: h = sum over octaves k of a_k n(2^k x / wavelength + k SHIFT), a_k ~ GAIN^k, sum a_k = height.

    n is 0 at the corners of unit cells and has a hash_cell gradient g in [-1, 1]^2 there; in between the four corners'
    planes g . (p - corner) are blended by f(t) = t^3 (t (6 t - 15) + 10), so n is twice differentiable. With weights w
    of the corners |n| <= sum w (|dx| + |dy|) <= 1, hence |h| <= height; in practice hills reach half of that.
    """

    height: float
    wavelength: float
    octaves: int = 4
    salt: int = 0

    @property
    def low(self) -> float:
        return -self.height

    @property
    def high(self) -> float:
        return self.height

    @property
    def steepest(self) -> float:
        rise = sum(a * 2.0**k for k, a in enumerate(self._amplitudes()))
        return STEEPEST * rise / self.wavelength

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        height, slope = np.empty(len(x)), np.empty((len(x), 2))
        for first in range(0, len(x), BLOCK):
            block = slice(first, first + BLOCK)
            height[block], slope[block] = self._sum_octaves(x[block], y[block])
        return height, slope

    def _sum_octaves(self, x: Float[Array, "n"], y: Float[Array, "n"]):
        octaves = np.arange(self.octaves)[:, None]
        cells = 2.0**octaves / self.wavelength
        noise, gradient = gradient_noise(
            x * cells + octaves * SHIFT[0], y * cells + octaves * SHIFT[1], HILLS + octaves, self.salt
        )
        height, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        for octave, amplitude in enumerate(self._amplitudes()):
            height += amplitude * noise[octave]
            slope += amplitude * cells[octave] * gradient[octave]
        return height, slope

    def _amplitudes(self) -> list[float]:
        shares = [1.0]
        for _ in range(1, self.octaves):
            shares.append(shares[-1] * GAIN)
        return [self.height * share / sum(shares) for share in shares]


@dataclass(frozen=True)
class HeightMap:
    """A height map, `width` world units wide, centred on the world's origin, its first row the northern one.

    h is the quadratic B-spline of the pixels: once differentiable, within the range of the pixels around. Beyond the
    map it is mirrored, or takes the pixels of the border (beyond = "clamp").
    """

    pixels: Float32[Array, "rows columns"]
    width: float
    beyond: str = "mirror"

    @property
    def low(self) -> float:
        return float(self.pixels.min())

    @property
    def high(self) -> float:
        return float(self.pixels.max())

    @property
    def steepest(self) -> float:
        """The slope of a B-spline is a mean of differences of neighbouring pixels."""
        most = [np.abs(np.diff(self.pixels, axis=axis)).max(initial=0) for axis in (0, 1)]
        return float(np.hypot(*most)) * self.pixels.shape[1] / self.width

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        rows, columns = self.pixels.shape
        per_unit = columns / self.width
        i, across, turn_x = _spline_weights(x * per_unit + 0.5 * columns)
        j, along, turn_y = _spline_weights(0.5 * rows - y * per_unit)
        height, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        for b in range(3):
            row = wrap_index(j + b - 1, rows, self.beyond)
            for a in range(3):
                value = self.pixels[row, wrap_index(i + a - 1, columns, self.beyond)].astype(float)
                height += value * across[a] * along[b]
                slope[:, 0] += value * turn_x[a] * along[b]
                slope[:, 1] -= value * across[a] * turn_y[b]  # rows go south
        return height, slope * per_unit


def wrap_index(index: Int64[Array, "*n"], n: int, beyond: str) -> Int64[Array, "*n"]:
    """Indices of a picture's n pixels for any index: mirrored, or the border's (beyond = "clamp")."""
    if beyond == "clamp":
        return np.clip(index, 0, n - 1)
    index = index % (2 * n)
    return np.where(index < n, index, 2 * n - 1 - index)


def surface_from_config(entry: dict, side: float) -> HeightField:
    """The surface that the config's `heights` describes; side: of a tile, the unit of hills and of the sphere.

    Raises: InputError: the image cannot be read (`read_height_map`), or its heights are beyond all bounds.
    """
    if entry["kind"] == "flat":
        return FlatSurface()
    if entry["kind"] == "sphere":
        return make_sphere(entry["radius"], side)
    if entry["kind"] == "hills":
        return Hills(entry["height"] * side, entry["wavelength"] * side, salt=entry.get("seed", 0))
    with np.errstate(over="ignore"):  # what becomes infinite is refused
        pixels = read_height_map(path := locate_path(entry["file"])) * np.float32(entry["height"])
    bad = ~(np.abs(pixels) <= FARTHEST)
    _refuse_pixels(path, bad, f"times heights.height is beyond {FARTHEST:g} units", "lower heights.height, or fill it")
    return HeightMap(pixels, float(entry["width"]), entry.get("beyond", "mirror"))


def read_height_map(path: Path | str) -> Float32[Array, "rows columns"]:
    """The first channel of a height map: integers scaled to [0, 1], floats unchanged.

    Raises: InputError: not readable, more than MAX_SIDE pixels along a side (checked before allocation), integers with
    a sign, or a pixel is not finite or without data.
    """
    check_height_map(path)
    pixels = image_files.read_channel(path)
    _refuse_pixels(path, ~np.isfinite(pixels), "is not finite", "fill it")
    missing = image_files.read_no_data(path)
    if missing is not None:
        _refuse_pixels(path, np.isclose(pixels, missing, 1e-6, 0), "is marked as no data", "fill it, or cut it off")
    return pixels


def _refuse_pixels(path: Path | str, bad: Bool[Array, "rows columns"], fault: str, remedy: str) -> None:
    if len(places := np.argwhere(bad)):
        row, column = places[0]
        raise InputError(f"{path}: the height in row {row}, column {column} {fault} ({len(places)} such); {remedy}")


def check_height_map(path: Path | str) -> None:
    """Raises: InputError: not readable as an image, or more than MAX_SIDE pixels along a side."""
    width, height = image_files.read_size(path)
    if max(width, height) > MAX_SIDE:
        raise InputError(f"{path}: {width} x {height} pixels; at most {MAX_SIDE} a side are read: shrink the image")


def _spline_weights(u: Float[Array, "n"]):
    """The pixel under each point, the weights of it and its two neighbours, and their derivatives."""
    pixel = np.floor(u)
    t = u - pixel - 0.5
    before, after = 0.5 - t, 0.5 + t
    weights = 0.5 * before * before, 0.75 - t * t, 0.5 * after * after
    return pixel.astype(np.int64), weights, (-before, -2 * t, after)


def gradient_noise(
    x: Float[Array, "*n"], y: Float[Array, "*n"], axis: int | Int64[Array, "#octaves 1"], salt: int
) -> tuple[Float[Array, "*n"], Float[Array, "*n 2"]]:
    """Gradient noise and its gradient; x and y in cells, axis of their hash.

    All corners are hashed at once: for few points the number of NumPy calls is what costs.
    """
    i, j = np.floor(x), np.floor(y)
    u, v = x - i, y - j
    step = np.arange(2).reshape(2, *[1] * x.ndim)
    bits = np.asarray(hash_cell(i.astype(np.int64) + step, j.astype(np.int64) + step[:, None], axis, salt))
    east, north = (bits & 0xFFFF) / 32767.5 - 1, (bits >> 16) / 32767.5 - 1
    planes = east * (u - step) + north * (v - step[:, None])
    fade_x, fade_y, turn_x, turn_y = smoothstep(u), smoothstep(v), _smoothstep_slope(u), _smoothstep_slope(v)
    value, by_x, by_y = np.zeros(x.shape), np.zeros(x.shape), np.zeros(x.shape)
    for b in (0, 1):
        for a in (0, 1):
            across, along = (fade_x if a else 1 - fade_x), (fade_y if b else 1 - fade_y)
            weight, plane = across * along, planes[b, a]
            value += weight * plane
            by_x += weight * east[b, a] + (turn_x if a else -turn_x) * along * plane
            by_y += weight * north[b, a] + across * (turn_y if b else -turn_y) * plane
    return value, np.stack([by_x, by_y], -1)


def smoothstep(t):
    """t^3 (t (6 t - 15) + 10): from 0 to 1, with first and second derivatives 0 at both ends."""
    return t * t * t * (t * (6 * t - 15) + 10)


def _smoothstep_slope(t):
    return 30 * t * t * (t * (t - 2) + 1)
