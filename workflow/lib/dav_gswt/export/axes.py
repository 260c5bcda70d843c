"""The axes of other formats, and Gaussians turned into them."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.field import GaussianField

# The rows give a format's x, y and z in our east, north and up.
Z_UP = np.eye(3)
# Right, down, forward: fields trained from COLMAP's cameras, SuperSplat, PlayCanvas and splat-transform.
Y_DOWN = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
# Right, up, back: glTF, SPZ and three.js.
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
AXES = {"z-up": Z_UP, "y-up": Y_UP, "y-down": Y_DOWN}  # as the config calls them


def turn_field(field: GaussianField, rotation: Float[Array, "3 3"]) -> GaussianField:
    """A field whose colours do not depend on the view, in a turned frame: a point p becomes rotation @ p.

    Raises: ValueError: the matrix is no proper rotation, or the field has harmonics above degree 0.
    """
    if not np.allclose(rotation @ rotation.T, np.eye(3)) or np.linalg.det(rotation) < 0 or field.sh_degree:
        raise ValueError("a field of degree 0 is turned by a proper rotation")
    return replace(field, means=turn_points(field.means, rotation), quats=turn_quats(field.quats, rotation))


def turn_points(points: Float[Array, "n 3"], rotation: Float[Array, "3 3"]) -> Float32[Array, "n 3"]:
    """Points in a turned frame. A rotation that swaps axes changes no digit."""
    return np.ascontiguousarray(points.astype(float) @ rotation.T, np.float32)


def turn_quats(quats: Float32[Array, "n 4"], rotation: Float[Array, "3 3"]) -> Float32[Array, "n 4"]:
    """Rotations w x y z in a turned frame, of length 1."""
    a, b, c, d = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    left = np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]])
    turned = (quats / np.abs(quats).max(1, keepdims=True)).astype(float) @ left.T
    return np.ascontiguousarray(turned / np.linalg.norm(turned, axis=1, keepdims=True), np.float32)
