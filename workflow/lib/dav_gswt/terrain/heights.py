"""Height fields: where the surface of the terrain lies, and how steep it is, at any point.

The page computes the same numbers; tests/golden/heights.json holds both to them. All is sums, products, quotients and
floor of float64, in the order written here.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.terrain.choice import hashed

HILLS = 3  # what a hash is for, after west, south and centre: the gradient of octave 0, 1, ...
GAIN = 0.4  # height of an octave over that of the one twice as wide
SHIFT = (0.37, 0.71)  # of each octave against the last, in its own cells: or all would be 0 at the corners of the first
STEEPEST = 2.75  # slope of the noise, per cell: the largest that any gradients at the corners give
MOST_CELLS = 67_108_864  # of a height map: 8192 x 8192


@runtime_checkable
class Heights(Protocol):
    """A surface z = h(x, y) without overhangs, once differentiable, over the whole plane.

    low, high: h lies between them everywhere. steepest: no slope, the length of h's gradient, exceeds it.
    """

    low: float
    high: float
    steepest: float

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        """h, and its derivatives by x and y, at points of the world."""
        ...


@dataclass(frozen=True)
class Flat:
    """h = 0."""

    low: float = 0.0
    high: float = 0.0
    steepest: float = 0.0

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        return np.zeros(len(x)), np.zeros((len(x), 2))


@dataclass(frozen=True)
class Hills:
    """Gradient noise: h = sum over octaves k of a_k n(2^k x / wavelength + k SHIFT), a_k ~ GAIN^k, sum a_k = height.

    n is 0 at the corners of unit cells and has a hashed gradient g in [-1, 1]^2 there; in between the four corners'
    planes g . (p - corner) are mixed by f(t) = t^3 (t (6 t - 15) + 10), so n is twice differentiable. With weights w
    of the corners |n| <= sum w (|dx| + |dy|) <= 1, hence |h| <= height; the highest hills rise to half of that.
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
        height, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        for octave, amplitude in enumerate(self._amplitudes()):
            cells = 2.0**octave / self.wavelength
            noise = _noise(x * cells + octave * SHIFT[0], y * cells + octave * SHIFT[1], HILLS + octave, self.salt)
            height += amplitude * noise[0]
            slope += amplitude * cells * noise[1]
        return height, slope

    def _amplitudes(self) -> list[float]:
        shares = [1.0]
        for _ in range(1, self.octaves):
            shares.append(shares[-1] * GAIN)
        return [self.height * share / sum(shares) for share in shares]


@dataclass(frozen=True)
class Relief:
    """A height map, `width` world units wide, its middle at the world's origin, its first row the northern one.

    Between the pixels h is their quadratic B-spline: once differentiable, never beyond the pixels around and hardly
    smoother than they are. Beyond the map it goes on mirrored, or as the border's pixels (beyond = "clamp").
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
        """A B-spline's slope is a mean of differences of neighbouring pixels."""
        most = [np.abs(np.diff(self.pixels, axis=axis)).max(initial=0) for axis in (0, 1)]
        return float(np.hypot(*most)) * self.pixels.shape[1] / self.width

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        rows, columns = self.pixels.shape
        per_unit = columns / self.width
        i, across, turn_x = _taps(x * per_unit + 0.5 * columns)
        j, along, turn_y = _taps(0.5 * rows - y * per_unit)
        height, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        for b in range(3):
            row = self._inside(j + b - 1, rows)
            for a in range(3):
                value = self.pixels[row, self._inside(i + a - 1, columns)].astype(float)
                height += value * across[a] * along[b]
                slope[:, 0] += value * turn_x[a] * along[b]
                slope[:, 1] -= value * across[a] * turn_y[b]  # rows go south
        return height, slope * per_unit

    def _inside(self, index: Array, n: int) -> Array:
        if self.beyond == "clamp":
            return np.clip(index, 0, n - 1)
        index = index % (2 * n)
        return np.where(index < n, index, 2 * n - 1 - index)


def of_config(entry: dict, side: float) -> Heights:
    """The surface that the config's `heights` asks for; side: of a tile, the unit of hills.

    Raises: InputError: the image cannot be read, is no picture or too large, or has pixels that are not finite.
    """
    if entry["kind"] == "flat":
        return Flat()
    if entry["kind"] == "hills":
        return Hills(entry["height"] * side, entry["wavelength"] * side, entry.get("octaves", 4), entry.get("seed", 0))
    pixels = read_map(entry["file"]) * np.float32(entry["height"])
    return Relief(pixels, float(entry["width"]), entry.get("beyond", "mirror"))


def read_map(path: Path | str) -> Float32[Array, "rows columns"]:
    """A height map's first channel: 0 to 1 where it is stored in integers, as it is where it is stored in floats.

    Raises: InputError: not readable, larger than MOST_CELLS (nothing is allocated then), or a pixel is not finite.
    """
    width, height = image_files.read_size(path)
    if width * height > MOST_CELLS:
        raise InputError(f"{path}: {width} x {height} heights; at most {MOST_CELLS} are read: shrink the image")
    pixels = image_files.read_channel(path)
    if len(bad := np.argwhere(~np.isfinite(pixels))):
        row, column = bad[0]
        raise InputError(f"{path}: the height in row {row}, column {column} is not finite ({len(bad)} such); fill it")
    return pixels


def _taps(u: Float[Array, "n"]):
    """The pixel under each point, and weights of it and its two neighbours, with their derivatives."""
    pixel = np.floor(u)
    t = u - pixel - 0.5
    before, after = 0.5 - t, 0.5 + t
    weights = 0.5 * before * before, 0.75 - t * t, 0.5 * after * after
    return pixel.astype(np.int64), weights, (-before, -2 * t, after)


def _noise(x: Float[Array, "n"], y: Float[Array, "n"], axis: int, salt: int):
    """Gradient noise and its gradient; x and y in cells."""
    i, j = np.floor(x), np.floor(y)
    u, v = x - i, y - j
    i, j = i.astype(np.int64), j.astype(np.int64)
    fade_x, fade_y, turn_x, turn_y = _fade(u), _fade(v), _turn(u), _turn(v)
    value, by_x, by_y = np.zeros(len(x)), np.zeros(len(x)), np.zeros(len(x))
    for b in (0, 1):
        for a in (0, 1):
            bits = hashed(i + a, j + b, axis, salt)
            east, north = (bits & 0xFFFF) / 32767.5 - 1, (bits >> 16) / 32767.5 - 1
            plane = east * (u - a) + north * (v - b)
            across, along = (fade_x if a else 1 - fade_x), (fade_y if b else 1 - fade_y)
            weight = across * along
            value += weight * plane
            by_x += weight * east + (turn_x if a else -turn_x) * along * plane
            by_y += weight * north + across * (turn_y if b else -turn_y) * plane
    return value, np.stack([by_x, by_y], 1)


def _fade(t):
    return t * t * t * (t * (6 * t - 15) + 10)


def _turn(t):
    return 30 * t * t * (t * (t - 2) + 1)
