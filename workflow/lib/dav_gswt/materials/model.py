"""What a terrain is made of: materials, each with its own tiles, and objects that stand on them."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField


@dataclass(frozen=True)
class MaterialInfo:
    """A class of ground.

    Attributes:
        name: for people and for the rules of the config.
        share: of the ground, in (0, 1]; the shares of all materials sum to 1.
        patch_scale: mean length, in world units, of the pieces of the material on a straight line.
        colour: mean sRGB colour, in [0, 1].
        strays: how far its borders stray, in world units, at each of `borders.WIDTHS`, as far as they were resolved;
            None if no border was seen.
    """

    name: str
    share: float
    patch_scale: float
    colour: list[float]
    strays: list[float] | None


@dataclass(frozen=True)
class ObjectLevels:
    """A single thing that was taken out of the ground and can be placed anywhere on its material.

    Attributes:
        name: for people.
        fields: its Gaussians at each level of the tiles, finest first. The foot is the origin.
        radius: of its footprint.
        material: number of the material that it stands on.
        density: number of such objects per unit of area of that material.
    """

    name: str
    fields: list[GaussianField]
    radius: float
    material: int
    density: float


def turn_rows(angle: Float[Array, "n"]) -> Float[Array, "n 4"]:
    """Cosine and sine of angles in radians, and of their halves."""
    return np.stack([np.cos(angle), np.sin(angle), np.cos(angle / 2), np.sin(angle / 2)], 1)


def turn_and_scale(
    field: GaussianField, way: Float[Array, "n 4"], size: Float[Array, "n"], foot: Float[Array, "n 3"]
) -> GaussianField:
    """Turn each Gaussian counter-clockwise by `way` (see `turn_rows`), scale it, and move it to its foot."""
    (cos, sin), (x, y, z) = way[:, :2].T, field.means.astype(float).T
    means = size[:, None] * np.stack([cos * x - sin * y, sin * x + cos * y, z], 1) + foot
    (c, s), (qw, qx, qy, qz) = way[:, 2:].astype(np.float32).T, field.quats.T
    quats = np.stack([c * qw - s * qz, c * qx - s * qy, c * qy + s * qx, c * qz + s * qw], 1)
    log_scales = field.log_scales + np.log(size)[:, None].astype(np.float32)
    return replace(field, means=means.astype(np.float32), log_scales=log_scales, quats=quats)
