"""Gaussians as records of 16 bytes (one texel of four 32-bit words of a viewer).

A record is little-endian:

    offset 0    3 x uint16    position: steps of the bundle's grid along x, y, z
    offset 6    3 x uint8     scale: steps of the logarithm of each axis's standard deviation
    offset 9    3 x uint8     rotation: x, y, z of the unit quaternion (w, x, y, z), w >= 0, about 127
    offset 12   4 x uint8     red, green, blue (sRGB) and opacity, 0 to 255

All tiles of a bundle share one grid, and a tile's side is a whole number of its steps: Gaussians that meet across a
border move alike. Colour does not depend on the direction.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float, Float64, Int
from numpy import ndarray as Array
from pydantic import ConfigDict, Field
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh

RECORD = np.dtype([("position", "<u2", 3), ("scale", "u1", 3), ("rotation", "u1", 3), ("rgba", "u1", 4)])
assert RECORD.itemsize == 16
POSITION_STEPS = 65535  # of the grid along an axis
MIN_STEPS_PER_TILE = 1024  # of the grid along a tile's side
STEPS_A_CELL = 32  # of the grid along a finest cell of ground, where tiles are composed
SCALE_STEPS = 255  # of a logarithm of a standard deviation
MAX_COMPONENT = np.sin(np.pi / 8)  # largest |x|, |y|, |z| of the smallest of an ellipsoid's 24 rotations
ROTATION_STEPS = 127  # of a component, either way
MIN_PIXELS = 1 / 64  # a thinner axis does not show: the rasterizer widens every splat by half a pixel
MAX_TILE_SIDES = 4.0  # longer axes are cut: a tile farther away than that is not drawn for what reaches out of it
HALF_STEP = 0.5 / 255  # of opacity: bytes 0 and 255 decode to half a step inside 0 and 1

# what the numbers of a manifest may be
Natural = Annotated[int, Field(ge=0)]
Length = Annotated[float, Field(gt=0)]
Size = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Colour = Annotated[list[Share], Field(min_length=3, max_length=3)]


class Entry:
    """A JSON object of the manifest: a base of dataclasses whose fields are its only keys."""

    __pydantic_config__ = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class Encoding(Entry):
    """How the records of all chunks of a bundle are read.

        position  = origin + step * (three uint16)
        deviation = exp(log_scale[0] + log_scale[1] * byte), one an axis
        rotation  = (w, x, y, z), each of x, y, z = sin(pi / 8) * (byte - 127) / 127, w = sqrt(1 - x^2 - y^2 - z^2)
        colour    = byte / 255, opacity = byte / 255

    Attributes:
        origin: place of step 0 of positions, along x, y and z.
        step: width of a step of positions, along x, y and z.
        log_scale: smallest natural logarithm of a standard deviation, and the step of logarithms.
        sh_degree: degree of the spherical harmonics of colours; always 0.
    """

    origin: Point
    step: Annotated[list[Size], Field(min_length=3, max_length=3)]
    log_scale: Pair
    sh_degree: Literal[0] = 0

    @classmethod
    def fit(cls, parts: list[GaussianField], side: float, pixel: float, cells: int | None = None) -> "Encoding":
        """The finest grid that holds all these Gaussians.

        Args: side: of a tile. pixel: width of a pixel on the nearest visible ground. cells: along a tile's side, if the
        grid must have whole steps in a cell; STEPS_A_CELL are enough then (more where a tile has few cells), and twice
        as many of height, by which views from above sort.
        Raises: InputError: the Gaussians spread so far that a tile's side has fewer than MIN_STEPS_PER_TILE steps.
        """
        places = [f.means.astype(float) for f in parts if len(f)]
        low, high = np.min([p.min(0) for p in places], 0), np.max([p.max(0) for p in places], 0)
        west, east = min(0.0, float(low[:2].min())), max(side, float(high[:2].max()))
        # one step less where the western rim is rounded outwards
        steps = np.floor((POSITION_STEPS - (west < 0)) * side / (east - west))
        if cells:
            enough = max(STEPS_A_CELL, -(-MIN_STEPS_PER_TILE // cells))
            steps = cells * min(enough, steps // cells)
        if steps < MIN_STEPS_PER_TILE:
            raise InputError(f"tiles: a splat lies {(east - west) / side:.0f} tile sides from another; cut them again")
        step = float(side / steps)
        west = -float(np.ceil(-west / step)) * step if west < 0 else 0.0
        rise = max(float(high[2] - low[2]) / POSITION_STEPS, step / 2 if cells else 0.0)
        sizes = np.concatenate([f.log_scales.ravel() for f in parts]).astype(float)
        sizes = np.clip(sizes, np.log(MIN_PIXELS * pixel), np.log(MAX_TILE_SIDES * side))
        least = float(sizes.min())
        log_scale = [least, float(sizes.max() - least) / SCALE_STEPS]
        return cls([west, west, float(low[2])], [step, step, rise], log_scale)

    def encode(self, field: GaussianField) -> Array:
        """The records of a field. Values outside of the ranges are clipped."""
        rows = np.empty(len(field), RECORD)
        step = np.array(self.step)
        place = (field.means.astype(float) - self.origin) / np.where(step > 0, step, 1)
        rows["position"] = np.clip(np.rint(place), 0, POSITION_STEPS)
        rotation, axes = find_smallest_rotations(field.quats)
        sizes = np.take_along_axis(field.log_scales.astype(float), axes, 1)
        rows["scale"] = np.clip(np.rint((sizes - self.log_scale[0]) / (self.log_scale[1] or 1)), 0, SCALE_STEPS)
        rows["rotation"] = ROTATION_STEPS + np.clip(
            np.rint(rotation[:, 1:] * (ROTATION_STEPS / MAX_COMPONENT)), -ROTATION_STEPS, ROTATION_STEPS
        )
        opacity = expit(field.opacity_logits.astype(float))
        rgba = np.concatenate([field.base_colours.astype(float), opacity[:, None]], 1)
        rows["rgba"] = np.rint(255 * np.clip(rgba, 0, 1))
        return rows

    def decode(self, rows: Array) -> GaussianField:
        """The Gaussians of records. Ground and uncertainty are not stored: no ground, 0."""
        xyz = (rows["rotation"].astype(float) - ROTATION_STEPS) * (MAX_COMPONENT / ROTATION_STEPS)
        w = np.sqrt(np.maximum(1 - (xyz**2).sum(1, keepdims=True), 0))
        opacity = np.clip(rows["rgba"][:, 3] / 255, HALF_STEP, 1 - HALF_STEP)
        return GaussianField(
            (np.array(self.origin) + rows["position"] * np.array(self.step)).astype(np.float32),
            (self.log_scale[0] + self.log_scale[1] * rows["scale"]).astype(np.float32),
            np.concatenate([w, xyz], 1).astype(np.float32),
            (np.log(opacity) - np.log1p(-opacity)).astype(np.float32),
            rgb_to_sh((rows["rgba"][:, :3] / 255).astype(np.float32)),
            np.zeros(len(rows), np.float32),
            np.zeros(len(rows), bool),
        )


def find_smallest_rotations(quats: Float[Array, "n 4"]) -> tuple[Float64[Array, "n 4"], Int[Array, "n 3"]]:
    """The smallest rotation of each ellipsoid, as a unit quaternion with w >= 0, and how its axes are permuted.

    An ellipsoid looks the same under 24 rotations q g, g in the rotations of the cube. The one with the largest w keeps
    |x|, |y| and |z| within sin(pi / 8): were |x| larger, a quarter turn about x would raise w to (w + |x|) / sqrt(2).

    Returns: quaternions, and for each new axis the index of the old one.
    """
    cube, source = Rotation.create_group("O"), Rotation.from_quat(quats.astype(float), scalar_first=True)
    # w of every product
    real = source.as_quat(scalar_first=True) @ (cube.as_quat(scalar_first=True) * [1, -1, -1, -1]).T
    best = np.argmax(np.round(np.abs(real), 12), axis=1)  # of equals the first, whatever the last bits
    axes = np.abs(cube.as_matrix()).argmax(1)  # of each column, the row that is not 0
    return (source * cube[best]).as_quat(canonical=True, scalar_first=True), axes[best]
