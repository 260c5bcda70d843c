"""The axes of other formats, and fields turned into them: centres, rotations, and colours that depend on the view."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.field import GaussianField
from dav_gswt.raster.harmonics import basis

# Rows: a format's x, y and z in our east, north, up.
Z_UP = np.eye(3)
# Right, down, forward, as fields trained from COLMAP's cameras lie and as SuperSplat, PlayCanvas and splat-transform
# take a PLY and a SOG: their scene shows y down as down.
Y_DOWN = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
# Right, up, back, as glTF and SPZ lie, and three.js takes them.
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
AXES = {"z-up": Z_UP, "y-up": Y_UP, "y-down": Y_DOWN}  # as the config calls them


def turn_field(field: GaussianField, rotation: Float[Array, "3 3"]) -> GaussianField:
    """The field in a turned frame: a point p becomes rotation @ p, and every view of it stays the same.

    Quaternions come out with length 1. rotation: a proper one. Raises: ValueError: it is not orthonormal, or mirrors.
    """
    if not np.allclose(rotation @ rotation.T, np.eye(3)) or np.linalg.det(rotation) < 0:
        raise ValueError("a frame is turned by a proper rotation")
    return replace(
        field,
        means=turn_points(field.means, rotation),
        quats=turn_quats(field.quats, rotation),
        sh=_turn_harmonics(field.sh, field.sh_degree, rotation),
    )


def turn_points(points: Float[Array, "n 3"], rotation: Float[Array, "3 3"]) -> Float32[Array, "n 3"]:
    """Points in a turned frame. Of a rotation that swaps axes every digit stays."""
    return np.ascontiguousarray(points.astype(float) @ rotation.T, np.float32)


def turn_quats(quats: Float32[Array, "n 4"], rotation: Float[Array, "3 3"]) -> Float32[Array, "n 4"]:
    """Rotations w x y z in a turned frame, of length 1."""
    a, b, c, d = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    left = np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]])
    turned = (quats / np.abs(quats).max(1, keepdims=True)).astype(float) @ left.T
    return np.ascontiguousarray(turned / np.linalg.norm(turned, axis=1, keepdims=True), np.float32)


def _turn_harmonics(sh: Float32[Array, "n k 3"], degree: int, rotation: Float[Array, "3 3"]) -> Float32[Array, "n k 3"]:
    """Coefficients whose colour in the direction rotation @ d is what it was in d.

    Each degree turns within itself, by the matrix M that solves basis(directions @ rotation.T) M = basis(directions).
    It is found from directions in general position, more of them than coefficients: the basis is exact on them.
    """
    if degree == 0:
        return sh
    directions = np.random.default_rng(0).normal(size=(64, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    before, after = basis(directions, degree), basis(directions @ rotation.T, degree)
    out = sh.copy()
    for level in range(1, degree + 1):
        own = slice(level**2, (level + 1) ** 2)
        matrix = np.linalg.lstsq(after[:, own], before[:, own], rcond=None)[0]
        out[:, own] = np.einsum("jk,nkc->njc", matrix, sh[:, own]).astype(np.float32)
    return out
