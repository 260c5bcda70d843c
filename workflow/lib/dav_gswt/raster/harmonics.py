"""Spherical harmonics up to degree 3: the colour of a Gaussian that depends on where it is seen from."""

from math import sqrt
from typing import Any

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera


def directions(means: Float[Array, "n 3"], camera: Camera) -> Float[Array, "n 3"]:
    """Unit directions in which the camera sees the Gaussians; forward for one in the camera's very centre."""
    if camera.orthographic:
        return np.broadcast_to(camera.forward, (len(means), 3))
    to = means - camera.centre
    length = np.linalg.norm(to, axis=1, keepdims=True)
    return np.where(length > 0, to / np.where(length > 0, length, 1), camera.forward)


def basis(directions: Float[Array, "n 3"], degree: int) -> Float[Array, "n k"]:
    """The real spherical harmonics of 3DGS, k = (degree + 1)^2 of them, in its order and with its signs.

    Orthonormal over the sphere.
    """
    x, y, z = np.asarray(directions, float).T
    return np.stack(list_terms(x, y, z, degree), 1)


def list_terms(x: Any, y: Any, z: Any, degree: int) -> list[Any]:
    """The harmonics of unit directions, of arrays or of tensors."""
    xx, yy, zz, pi = x * x, y * y, z * z, np.pi
    rows = [0 * x + sqrt(1 / (4 * pi))]
    if degree >= 1:
        rows += [sqrt(3 / (4 * pi)) * f for f in (-y, z, -x)]
    if degree >= 2:
        a, b = sqrt(15 / (4 * pi)), sqrt(5 / (16 * pi))
        rows += [a * x * y, -a * y * z, b * (3 * zz - 1), -a * x * z, a / 2 * (xx - yy)]
    if degree >= 3:
        a, b, c, d = (sqrt(v / pi) for v in (35 / 32, 105 / 4, 21 / 32, 7 / 16))
        rows += [-a * y * (3 * xx - yy), b * x * y * z, -c * y * (5 * zz - 1), d * z * (5 * zz - 3)]
        rows += [-c * x * (5 * zz - 1), b / 2 * z * (xx - yy), -a * x * (xx - 3 * yy)]
    return rows


def seen_colours(sh: Float[Array, "n k 3"], means: Float[Array, "n 3"], camera: Camera) -> Float32[Array, "n 3"]:
    """Colours of Gaussians as the camera sees them: max(0, 0.5 + sum over k of basis_k sh_k); k is 1, 4, 9 or 16."""
    k = sh.shape[1]
    if k == 1:
        return np.maximum(0.5 + np.float32(np.sqrt(1 / (4 * np.pi))) * sh[:, 0], 0).astype(np.float32)
    values = np.einsum("nk,nkc->nc", basis(directions(means, camera), int(np.sqrt(k)) - 1), sh)
    return np.maximum(0.5 + values, 0).astype(np.float32)
