"""Projected splats: Gaussians projected as the viewer does, and alpha-blended in a given order.

The rasterizer sorts by depth. To blend in a given order, each splat becomes a flat Gaussian in the picture plane whose
depth is its rank, seen by an orthographic camera. Its covariance there is the splat's, so every backend can render it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, Rows
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import Rendering, harmonics, make_rasterizer
from dav_gswt.terrain.heights import Slope, displaced_axes

DILATION = 0.3  # square pixels, added to variances by the rasterizer
MARGIN = 0.15  # of the picture's side: beyond it the projection is linearised at this margin
FADE_IN = (1.8, 3.2)  # ratio of depth to its standard deviation over which a Gaussian fades in
RIM2 = 2 * np.log(255.0)  # squared Mahalanobis distance at which an opaque splat ends
THINNEST = 1e-9  # pixels


@dataclass(frozen=True)
class Splats(Rows):
    """Ellipses in pixels: centres, log standard deviations of two axes, angle of the first axis from x."""

    centres: Float32[Array, "n 2"]
    log_scales: Float32[Array, "n 2"]
    angles: Float32[Array, "n"]
    opacity_logits: Float32[Array, "n"]
    colours: Float32[Array, "n 3"]
    depths: Float32[Array, "n"]


EMPTY = Splats(*(np.zeros((0, *width), np.float32) for width in ((2,), (2,), (), (), (3,), ())))


def depth_order(splats: Splats) -> Int[Array, "n"]:
    """Indices of the splats from back to front; of equal depths the later one comes first, as in the rasterizer."""
    return np.argsort(splats.depths, kind="stable")[::-1]


def project(field: GaussianField, slope: Slope, camera: Camera, near: float) -> tuple[Splats, Int[Array, "k"]]:
    """Project Gaussians on a surface of these slopes, in their order; those outside the picture are culled.

    S = (J W A)(J W A)^T with A of `displaced_axes` (EWA); its determinant by Lagrange's identity |p x q|^2. A Gaussian
    whose depth is small against its extent in depth fades out: its linearised splat would cover the picture up to the
    horizon. The viewer does the same.

    Returns: the splats, and the index of each in the field.
    """
    q = np.ascontiguousarray((field.means.astype(float) @ camera.rotation.T + camera.translation).T)
    ahead = np.flatnonzero(q[2] > near)
    field, q = field[ahead], q[:, ahead]
    axes = np.ascontiguousarray(displaced_axes(field, slope[ahead]).transpose(1, 2, 0))  # NumPy is slow along axes of 3
    axes = (camera.rotation @ axes.reshape(3, -1)).reshape(axes.shape)
    x, y = q[0] / q[2], q[1] / q[2]
    bound_x, bound_y = (
        np.clip(slope, -(c + MARGIN * size) / f, (size - c + MARGIN * size) / f)
        for slope, c, f, size in ((x, camera.cx, camera.fx, camera.width), (y, camera.cy, camera.fy, camera.height))
    )
    across = (axes[0] - bound_x * axes[2]) * (camera.fx / q[2])
    along = (axes[1] - bound_y * axes[2]) * (camera.fy / q[2])
    depth = q[2] / np.maximum(np.sqrt(_dot(axes[2], axes[2])), 1e-300)
    share = np.clip((depth - FADE_IN[0]) / (FADE_IN[1] - FADE_IN[0]), 0, 1)
    share = share * share * (3 - 2 * share)
    visible = share > 0
    centres = camera.fx * x + camera.cx, camera.fy * y + camera.cy
    for at, axis, size in zip(centres, (across, along), (camera.width, camera.height), strict=True):
        extent = np.sqrt(RIM2 * (_dot(axis, axis) + DILATION))
        visible &= (at + extent > 0) & (at - extent < size)
    share, logits = share[visible], field.opacity_logits[visible]
    opacity = share / (1 + np.exp(-logits.astype(float)))
    with np.errstate(divide="ignore"):
        faded = np.log(opacity) - np.log1p(-opacity)
    log_scales, angles = _ellipses(across[:, visible], along[:, visible])
    splats = Splats(
        np.stack([at[visible] for at in centres], 1).astype(np.float32),
        log_scales,
        angles,
        np.where(share == 1, logits, faded).astype(np.float32),
        harmonics.seen_colours(field.sh[visible], field.means[visible].astype(float), camera),
        q[2, visible].astype(np.float32),
    )
    return splats, ahead[visible]


def _dot(one: Float[Array, "3 n"], other: Float[Array, "3 n"]) -> Float[Array, "n"]:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def blend(splats: Splats, camera: Camera) -> Rendering:
    """Alpha-blend splats that are given back to front; the `depth` of the rendering is their rank."""
    n = len(splats)
    flat = Camera(np.eye(3), np.zeros(3), 1.0, 1.0, 0.0, 0.0, camera.width, camera.height, True)
    rank = np.arange(n, 0, -1, dtype=np.float32)
    return make_rasterizer(dilation=DILATION).forward(
        np.concatenate([splats.centres, rank[:, None]], 1),
        np.concatenate([splats.log_scales, np.full((n, 1), np.log(THINNEST), np.float32)], 1),
        np.stack([np.cos(splats.angles / 2), *np.zeros((2, n)), np.sin(splats.angles / 2)], 1).astype(np.float32),
        splats.opacity_logits,
        splats.colours,
        flat,
    )


def _ellipses(across: Float[Array, "3 n"], along: Float[Array, "3 n"]):
    """Log standard deviations along the two axes of S, and the angle of the first."""
    a, b, c = _dot(across, across), _dot(across, along), _dot(along, along)
    major = 0.5 * (a + c) + np.hypot(0.5 * (a - c), b)
    (p, q, r), (u, v, w) = across, along
    area = (q * w - r * v) ** 2 + (r * u - p * w) ** 2 + (p * v - q * u) ** 2
    minor = area / np.maximum(major, THINNEST**2)
    variances = np.maximum(np.stack([major, minor], 1), THINNEST**2)
    return (0.5 * np.log(variances)).astype(np.float32), (0.5 * np.arctan2(2 * b, a - c)).astype(np.float32)
