"""Surfaces of the terrain: height and slope at any point, and Gaussians moved onto them.

Each surface is one class that registers itself by its `kind`, the key of the config's `heights` and of the `heights`
entry in the manifest of a page. The viewer's `terrain/heights.js` computes the same numbers; tests/golden/heights.json
holds both to them. Only sums, products, quotients and floor of float64 are used, in the order written here.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Float32, Int64
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.bundle.manifest import NAME
from dav_gswt.bundle.parts import read_exactly
from dav_gswt.errors import InputError, summarize_error
from dav_gswt.field import GaussianField
from dav_gswt.files import locate_path, parse_record
from dav_gswt.images import image_files
from dav_gswt.terrain.choice import Floats, Vector, hash_cell

HILLS = 3  # axis of the hash of octave 0, after west, south and centre; octave k uses HILLS + k
GAIN = 0.4  # height of an octave over that of the one twice as wide
SHIFT = (0.37, 0.71)  # of each octave against the last, in its own cells; else all are 0 at the corners of the first
STEEPEST = 2.75  # upper bound of the slope of the noise, per cell, over all gradients at the corners
WAVELENGTH = (24.0, 16.0, 32.0)  # of hills of no size: in heights of the eye; at least and at most, in tile sides
WALKABLE = (
    0.25  # height of hills over their wavelength: half of the ground is less steep than 0.14, 1 % steeper than 0.36
)
FARTHEST = 1e9  # units from 0 to a height: more is refused by the page too
MAX_SIDE = 4096  # pixels along a side of a height map: every WebGL2 device in use takes textures of this size
PIXELS = "heights.bin"  # the pixels of a height map in a page: float32, little-endian, rows from the north
QUARTER = 0.5 * np.pi
THINNEST = 1e-30  # lower bound of an axis that a slope flattens to zero

SURFACES: dict[str, type["HeightField"]] = {}


class HeightField:
    """A surface z = h(x, y), once differentiable, over the whole plane; this base class is level ground.

    A subclass needs the keyword `kind`, and may override everything below.
    """

    kind: ClassVar[str]

    def __init_subclass__(cls, kind: str) -> None:
        cls.kind = kind
        SURFACES[kind] = cls

    @property
    def bounds(self) -> tuple[float, float, float]:
        """Lower and upper bound of h, and upper bound of the length of its gradient."""
        return 0.0, 0.0, 0.0

    def at(self, x: Floats, y: Floats) -> tuple[Floats, Float[Array, "n 2"]]:
        """h and its derivatives by x and y at points of the world."""
        return np.zeros(len(x)), np.zeros((len(x), 2))

    def smooth_at(self, x: Floats, y: Floats, spacing: Floats | float) -> tuple[Floats, Float[Array, "n 2"]]:
        """`at` without detail that points at this spacing cannot show, where the surface can leave that out."""
        return self.at(x, y)

    @classmethod
    def from_config(cls, entry: Mapping[str, Any], side: float, eye: float) -> "HeightField":
        """The surface of the config's `heights`; see `surface_from_config`. Raises: InputError: it cannot be made."""
        return cls()

    def describe(self) -> tuple[dict[str, Any], bytes]:
        """The `heights` entry of a page's manifest, and the content of PIXELS (empty: no file)."""
        return {"kind": self.kind} | vars(self), b""

    @classmethod
    def from_page(cls, folder: Path, entry: Mapping[str, Any], side: float) -> "HeightField":
        """The surface that `describe` described. Raises: InputError, KeyError, TypeError, ValueError: it is damaged."""
        return parse_record(dict(entry), cls)


def surface_from_config(entry: Mapping[str, Any], side: float, eye: float) -> HeightField:
    """The surface that the config's `heights` describes.

    Args:   side: of a tile, the unit of hills and of the sphere. eye: lowest height of the eye, for hills of no size.

    Raises: InputError: the image cannot be read (`read_height_map`), or its heights are beyond all bounds.
    """
    return SURFACES[entry["kind"]].from_config(entry, side, eye)


def read_surface(folder: Path, entry: Mapping[str, Any], side: float) -> HeightField:
    """The surface of a page folder, from the `heights` entry of its manifest. side: of a tile.

    Raises: InputError: a height map is missing or damaged, or the entry is unknown or makes no sense.
    """
    try:
        return SURFACES[entry["kind"]].from_page(folder, entry, side)
    except (KeyError, TypeError, ValueError) as error:
        why = summarize_error(error)
        raise InputError(f"{folder / NAME}: heights make no sense ({why}); make the page again") from error


@dataclass(frozen=True)
class FlatSurface(HeightField, kind="flat"):
    """h = 0."""


@dataclass(frozen=True)
class Hills(HeightField, kind="hills"):
    """Gradient noise: h = sum over octaves k of a_k n(2^k x / wavelength + k SHIFT), a_k ~ GAIN^k, sum a_k = height.

    |n| <= 1, hence |h| <= height; in practice hills reach half of that.
    """

    height: float
    wavelength: float
    octaves: int = 4
    salt: int = 0

    @property
    def bounds(self) -> tuple[float, float, float]:
        rise = sum(a * 2.0**k for k, a in enumerate(self._amplitudes()))
        return -self.height, self.height, STEEPEST * rise / self.wavelength

    def at(self, x: Floats, y: Floats) -> tuple[Floats, Float[Array, "n 2"]]:
        return self.smooth_at(x, y, 0.0)

    def smooth_at(self, x: Floats, y: Floats, spacing: Floats | float) -> tuple[Floats, Float[Array, "n 2"]]:
        """An octave has its full height up to four points a cell, and none below two."""
        octaves = np.arange(self.octaves)[:, None]
        cells = 2.0**octaves / self.wavelength
        noise, gradient = gradient_noise(
            x * cells + octaves * SHIFT[0], y * cells + octaves * SHIFT[1], HILLS + octaves, self.salt
        )
        height, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        kept = np.clip(2 - 4 * spacing * cells, 0, 1)
        for octave, amplitude in enumerate(self._amplitudes()):
            height += kept[octave] * (amplitude * noise[octave])
            slope += kept[octave][:, None] * (amplitude * cells[octave] * gradient[octave])
        return height, slope

    def _amplitudes(self) -> list[float]:
        shares = [1.0]
        for _ in range(1, self.octaves):
            shares.append(shares[-1] * GAIN)
        return [self.height * share / sum(shares) for share in shares]

    @classmethod
    def from_config(cls, entry: Mapping[str, Any], side: float, eye: float) -> "Hills":
        wavelength = entry["wavelength"]
        if wavelength == "auto":
            wavelength = min(max(WAVELENGTH[0] * eye / side, WAVELENGTH[1]), WAVELENGTH[2])
        height = WALKABLE * wavelength if entry["height"] == "auto" else entry["height"]
        return cls(height * side, wavelength * side)


@dataclass(frozen=True)
class HeightMap(HeightField, kind="image"):
    """A height map, `width` world units wide, centred on the world's origin, its first row the northern one.

    h is the quadratic B-spline of the pixels: once differentiable, within the range of the pixels around. Beyond the
    map it is mirrored.
    """

    pixels: Float32[Array, "rows columns"]
    width: float

    @property
    def bounds(self) -> tuple[float, float, float]:
        """The slope of a B-spline is a mean of differences of neighbouring pixels."""
        most = [np.abs(np.diff(self.pixels, axis=axis)).max(initial=0) for axis in (0, 1)]
        steepest = float(np.hypot(*most)) * self.pixels.shape[1] / self.width
        return float(self.pixels.min()), float(self.pixels.max()), steepest

    def at(self, x: Floats, y: Floats) -> tuple[Floats, Float[Array, "n 2"]]:
        rows, columns = self.pixels.shape
        per_unit = columns / self.width
        i, across, turn_x = _spline_weights(x * per_unit + 0.5 * columns)
        j, along, turn_y = _spline_weights(0.5 * rows - y * per_unit)
        height, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        for b in range(3):
            row = _mirror_index(j + b - 1, rows)
            for a in range(3):
                value = self.pixels[row, _mirror_index(i + a - 1, columns)].astype(float)
                height += value * across[a] * along[b]
                slope[:, 0] += value * turn_x[a] * along[b]
                slope[:, 1] -= value * across[a] * turn_y[b]  # rows go south
        return height, slope * per_unit

    @classmethod
    def from_config(cls, entry: Mapping[str, Any], side: float, eye: float) -> "HeightMap":
        with np.errstate(over="ignore"):  # what becomes infinite is refused
            pixels = read_height_map(path := locate_path(entry["file"])) * np.float32(entry["height"])
        fault, bad = f"times heights.height is beyond {FARTHEST:g} units", ~(np.abs(pixels) <= FARTHEST)
        _refuse_pixels(path, bad, fault, "lower heights.height, or fill it")
        return cls(pixels, float(entry["width"]))

    def describe(self) -> tuple[dict[str, Any], bytes]:
        rows, columns = self.pixels.shape
        data = self.pixels.astype("<f4").tobytes()
        entry = {"kind": self.kind, "file": PIXELS, "rows": rows, "columns": columns, "width": self.width}
        entry |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        return entry, data

    @classmethod
    def from_page(cls, folder: Path, entry: Mapping[str, Any], side: float) -> "HeightMap":
        rows, columns, width = int(entry["rows"]), int(entry["columns"]), float(entry["width"])
        if not (0 < rows <= MAX_SIDE and 0 < columns <= MAX_SIDE and 0 < width < np.inf):
            raise ValueError("a size is out of range")
        data = read_exactly(folder, entry["file"], 4 * rows * columns, entry["sha256"])
        pixels = np.frombuffer(data, "<f4").reshape(rows, columns).astype(np.float32)
        if not np.isfinite(pixels).all():
            raise InputError(f"{folder / entry['file']}: a height is not finite; make the page again")
        return cls(pixels, width)


@dataclass(frozen=True)
class Sphere(HeightField, kind="sphere"):
    """A sphere about the world's origin: a height field that is 0 above it. Its faces are those of `sphere`.

    radius: of the ground, in world units. side: of a tile. cells: along the side of a face.
    """

    radius: float
    side: float
    cells: int

    @property
    def rate(self) -> float:
        """Angle of a world unit on a tile."""
        return QUARTER / (self.cells * self.side)

    def column(self, face: Int64[Array, "*n"], i: Int64[Array, "*n"]) -> Int64[Array, "*n"]:
        """The columns of all faces beside each other, each with one more beyond its western and its eastern edge."""
        return face * (self.cells + 2) + i + 1

    def tangents(self, a: Float[Array, "*n"], b: Float[Array, "*n"]) -> Float[Array, "*n 2"]:
        """Tangents of the two angles of points of a face, in cells from its south-western corner."""
        return np.tan((np.stack([a, b], -1) / self.cells - 0.5) * QUARTER)

    @classmethod
    def from_config(cls, entry: Mapping[str, Any], side: float, eye: float) -> "Sphere":
        return make_sphere(entry["radius"], side)

    def describe(self) -> tuple[dict[str, Any], bytes]:
        return {"kind": self.kind, "radius": self.radius, "cells": self.cells}, b""

    @classmethod
    def from_page(cls, folder: Path, entry: Mapping[str, Any], side: float) -> "Sphere":
        return parse_record(dict(entry) | {"side": side}, cls)


def make_sphere(radius: float, side: float) -> Sphere:
    """A sphere with as many cells as make their mean area that of a tile. radius: in tile sides."""
    return Sphere(radius * side, side, max(1, round(radius * np.sqrt(2 * np.pi / 3))))


def require_plain_cover(surface: HeightField, classes: object, objects: object) -> None:
    """Refuse several materials, and objects, on a sphere. Raises: InputError."""
    if isinstance(surface, Sphere) and (classes or objects):
        what = "several materials" if classes else "objects"
        raise InputError(
            f"heights: a sphere is covered with one material and no objects, and this scene has {what}: "
            "give the scene `materials: one`, or choose another surface"
        )


def _mirror_index(index: Int64[Array, "*n"], n: int) -> Int64[Array, "*n"]:
    """Indices of an image's n pixels for any index."""
    index = index % (2 * n)
    return np.where(index < n, index, 2 * n - 1 - index)


def read_height_map(path: Path | str) -> Float32[Array, "rows columns"]:
    """The first channel of a height map: integers scaled to [0, 1], floats unchanged.

    Raises: InputError: not readable, more than MAX_SIDE pixels along a side (checked before allocation), integers with
    a sign, or a pixel is not finite or without data.
    """
    width, height = image_files.read_size(path)
    if max(width, height) > MAX_SIDE:
        raise InputError(f"{path}: {width} x {height} pixels; at most {MAX_SIDE} a side are read: shrink the image")
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


def _spline_weights(u: Floats):
    """The pixel under each point, the weights of it and its two neighbours, and their derivatives."""
    pixel = np.floor(u)
    t = u - pixel - 0.5
    before, after = 0.5 - t, 0.5 + t
    weights = 0.5 * before * before, 0.75 - t * t, 0.5 * after * after
    return pixel.astype(np.int64), weights, (-before, -2 * t, after)


def gradient_noise(
    x: Float[Array, "*n"], y: Float[Array, "*n"], axis: int | Int64[Array, "#octaves 1"], salt: int
) -> tuple[Float[Array, "*n"], Float[Array, "*n 2"]]:
    """Gradient noise and its gradient; x and y in cells, axis of their hash."""
    i, j = np.floor(x), np.floor(y)
    u, v = x - i, y - j
    step = np.arange(2).reshape(2, *[1] * x.ndim)
    bits = _hash_corners(i.astype(np.int64), j.astype(np.int64), step, axis, salt)
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


def _hash_corners(i: Int64[Array, "*n"], j: Int64[Array, "*n"], step: Array, axis: Any, salt: int) -> Array:
    """Bits of the four corners [north, east] of cells; of a few cells that many points lie in, each corner once."""
    if isinstance(axis, int) and i.size:
        west, south = int(i.min()), int(j.min())
        columns, rows = int(i.max()) - west + 2, int(j.max()) - south + 2
        if columns * rows < i.size:
            bits = hash_cell(west + np.arange(columns), south + np.arange(rows)[:, None], axis, salt)
            return np.asarray(bits)[j - south + step[:, None], i - west + step]
    return np.asarray(hash_cell(i + step, j + step[:, None], axis, salt))


def smoothstep(t):
    """t^3 (t (6 t - 15) + 10): from 0 to 1, with first and second derivatives 0 at both ends."""
    return t * t * t * (t * (6 * t - 15) + 10)


def _smoothstep_slope(t):
    return 30 * t * t * (t * (t - 2) + 1)


Slope = Float[Array, "n 2"] | Float[Array, "n 3 3"]  # of a height field; on a sphere J itself


def displace_means(
    field: GaussianField, heights: HeightField, corner: Vector, origin: Vector
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """Move centres from (x, y, z) to (x, y, z + h(x, y)); also returns the surface's slope at each.

    No Gaussian leaves the column of its tile, so neighbouring tiles still meet. Shapes are unchanged; see
    `displaced_axes`.

    Args:   corner, origin: world positions of the origin of the field's means, and of the returned means.
    """
    means = field.means.astype(float)
    height, slope = heights.at(means[:, 0] + corner[0], means[:, 1] + corner[1])
    means += corner - origin
    means[:, 2] += height
    return replace(field, means=means.astype(np.float32)), slope


def displaced_axes(field: GaussianField, slope: Slope) -> Float[Array, "n 3 3"]:
    """A = J R S of every Gaussian on a surface of these slopes; its covariance is A A^T = J Sigma J^T.

    J = [[1, 0, 0], [0, 1, 0], [h_x, h_y, 1]] is the derivative of `displace_means`. The columns of R S are the
    Gaussian's axes, scaled by their standard deviations. On a sphere J is given (see `sphere.bend`).
    """
    rotation = Rotation.from_quat(field.quats.astype(float), scalar_first=True).as_matrix()
    axes = rotation * np.exp(field.log_scales.astype(float))[:, None]
    if slope.ndim == 3:
        return slope @ axes
    axes[:, 2] += slope[:, 0, None] * axes[:, 0] + slope[:, 1, None] * axes[:, 1]
    return axes


def displace_field(field: GaussianField, heights: HeightField, corner: Vector, origin: Vector) -> GaussianField:
    """The field on the surface, as Gaussians that any rasterizer draws: `displace_means`, shapes by `displaced_axes`.

    A is factored as R' S' V^T; its singular values are the new scales, so needles keep their digits. Where the surface
    is level a Gaussian keeps its bits.
    """
    raised, slope = displace_means(field, heights, corner, origin)
    steep = np.flatnonzero((slope != 0).any(1))
    rotation, scales, _ = np.linalg.svd(displaced_axes(field[steep], slope[steep]))
    rotation[:, :, 2] *= np.sign(np.linalg.det(rotation))[:, None]
    quats, log_scales = field.quats.copy(), field.log_scales.copy()
    quats[steep] = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    log_scales[steep] = np.log(np.maximum(scales, THINNEST))
    return replace(raised, quats=quats, log_scales=log_scales)
