"""A robust plane through points, and the frame that stands upright on it."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError

TRIALS = 500  # planes through three random points; at half outliers one in eight has none


def fit_plane(
    points: Float[Array, "n 3"], rng: np.random.Generator, up: Float[Array, "3"] | None = None
) -> tuple[Float[Array, "3"], float, float]:
    """A robust plane through points: unit normal n and offset d of n . p = d, and the points' spread about it.

    Least median of |n . p - d| over TRIALS planes through three points, then ten rounds of least squares under
    Geman-McClure weights (1 + (r / s)^2)^-2. The scale s is 1.4826 times the median residual of the first plane, which
    is the standard deviation where residuals are normal; so hills and trees may be up to half of the points.
    up: a direction roughly upwards, where one is known: then only planes within 45 degrees of level are tried, and n
    points upwards.
    Sums are in one order: those of BLAS depend on the number of its threads.
    Raises: InputError: fewer than three points, all on one line, or none in such a plane.
    """
    if len(points) < 3:
        raise InputError("fewer than three points of the ground are known; take more photos that overlap")
    middle = np.median(points, axis=0)
    centred = points - middle
    sample = centred[rng.choice(len(points), min(len(points), 2000), replace=False)]
    a, b, c = (sample[rng.integers(len(sample), size=TRIALS)] for _ in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-9 * np.abs(sample).max() ** 2
    if up is not None:
        proper &= np.abs(normals @ up) > np.sqrt(0.5) * np.linalg.norm(up) * lengths
    if not proper.any():
        raise InputError("the points lie in no level plane, or all on one line: they do not determine the ground")
    normals = normals[proper] / lengths[proper, None]
    offsets = np.einsum("ti,ti->t", normals, a[proper])
    medians = np.median(np.abs(np.einsum("ni,ti->nt", sample, normals) - offsets), axis=0)
    normal, offset = normals[medians.argmin()], offsets[medians.argmin()]
    scale = 1.4826 * medians.min() + 1e-12 * np.abs(sample).max()
    for _ in range(10):
        weight = (1 + ((np.einsum("ni,i->n", centred, normal) - offset) / scale) ** 2) ** -2
        centre = np.einsum("n,ni->i", weight, centred) / weight.sum()
        away = centred - centre
        normal = np.linalg.eigh(np.einsum("ni,nj->ij", away * weight[:, None], away))[1][:, 0]
        offset = normal @ centre
    if up is not None and normal @ up < 0:
        normal, offset = -normal, -offset
    return normal, float(offset + normal @ middle), float(scale)


def make_upright_rotation(normal: Float[Array, "3"], east: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """The rotation into a frame with z along `normal` and x along the part of `east` that lies in the plane."""
    x = east - (east @ normal) * normal
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal])
