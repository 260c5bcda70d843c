"""Splats in a given order: Gaussians projected as the page projects them, and blended without being sorted again.

The rasterizer sorts by depth. Here each Gaussian becomes a flat one in a picture plane, at the depth of its place in
the order, and an orthographic camera looks at that: its covariance there is the splat's own, so the picture is what
the rasterizer would draw if it took orders, and every backend can draw it.
"""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import Rasterizer, Rendering, harmonics
from dav_gswt.terrain.drape import axes

DILATION = 0.3  # square pixels, added by the rasterizer
MARGIN = 0.15  # of the picture's side: further out the camera is linearised at this rim
SOFT = (1.8, 3.2)  # depth over its own standard deviation between which a Gaussian fades in
RIM2 = 2 * np.log(255.0)  # the quadratic form where an opaque splat ends
THINNEST = 1e-9  # pixels


@dataclass(frozen=True)
class Splats:
    """Ellipses in the picture, in pixels: centres, standard deviations of two axes, angle of the first from x."""

    centres: Float32[Array, "n 2"]
    log_scales: Float32[Array, "n 2"]
    angles: Float32[Array, "n"]
    opacity_logits: Float32[Array, "n"]
    colours: Float32[Array, "n 3"]
    depths: Float32[Array, "n"]

    def __len__(self) -> int:
        return len(self.centres)

    def __getitem__(self, index) -> "Splats":
        return Splats(*(getattr(self, f.name)[index] for f in fields(self)))


NONE = Splats(*(np.zeros((0, *width), np.float32) for width in ((2,), (2,), (), (), (3,), ())))


def joined(parts: list[Splats]) -> Splats:
    """All splats of all parts, in their order."""
    return Splats(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Splats)))


def sorted_by_depth(splats: Splats) -> Splats:
    """Exactly sorted, back to front; of equal depths the later one comes first, as in the rasterizer."""
    return splats[by_depth(splats)]


def by_depth(splats: Splats) -> Int[Array, "n"]:
    """Indices of the splats back to front."""
    return np.argsort(splats.depths, kind="stable")[::-1]


def projected(field: GaussianField, slope: Float[Array, "n 2"], camera: Camera, near: float) -> Splats:
    """The Gaussians, on a surface of these slopes, that may show in a pinhole camera's picture; in their order."""
    return indexed(field, slope, camera, near)[0]


def indexed(
    field: GaussianField, slope: Float[Array, "n 2"], camera: Camera, near: float
) -> tuple[Splats, Int[Array, "k"]]:
    """The Gaussians that may show, and which they are.

    S = (J W A)(J W A)^T with A of `drape.axes` (EWA), its determinant by Lagrange's identity |p x q|^2. A Gaussian
    that is nearly as deep as it is far fades: a plane through its centre says nothing about its rim, and discs
    underfoot would be drawn up over the horizon as haze. The page does the same.
    """
    q = field.means.astype(float) @ camera.rotation.T + camera.translation
    ahead = np.flatnonzero(q[:, 2] > near)
    field, q = field[ahead], q[ahead]
    seen = camera.rotation @ axes(field, slope[ahead])
    x, y = q[:, 0] / q[:, 2], q[:, 1] / q[:, 2]
    bound_x, bound_y = (
        np.clip(slope, -(c + MARGIN * size) / f, (size - c + MARGIN * size) / f)
        for slope, c, f, size in ((x, camera.cx, camera.fx, camera.width), (y, camera.cy, camera.fy, camera.height))
    )
    per_z = 1 / q[:, 2, None]
    across = (seen[:, 0] - bound_x[:, None] * seen[:, 2]) * (camera.fx * per_z)
    along = (seen[:, 1] - bound_y[:, None] * seen[:, 2]) * (camera.fy * per_z)
    centres = np.stack([camera.fx * x + camera.cx, camera.fy * y + camera.cy], 1)
    extents = np.sqrt(RIM2 * (np.stack([(across**2).sum(1), (along**2).sum(1)], 1) + DILATION))
    share = _fading_in(q[:, 2] / np.maximum(np.linalg.norm(seen[:, 2], axis=1), 1e-300))
    shown = ((centres + extents > 0) & (centres - extents < [camera.width, camera.height])).all(1) & (share > 0)
    log_scales, angles = _ellipses(across[shown], along[shown])
    towards = harmonics.directions(field.means[shown].astype(float), camera)
    found = Splats(
        centres[shown].astype(np.float32),
        log_scales,
        angles,
        _scaled(field.opacity_logits[shown], share[shown]),
        harmonics.colours(field.sh[shown], towards),
        q[shown, 2].astype(np.float32),
    )
    return found, ahead[shown]


def blended(splats: Splats, camera: Camera) -> Rendering:
    """The picture of splats that are given back to front; `depth` is their place in that order, and means nothing."""
    n = len(splats)
    flat = Camera(np.eye(3), np.zeros(3), 1.0, 1.0, 0.0, 0.0, camera.width, camera.height, True)
    place = np.arange(n, 0, -1, dtype=np.float32)
    return Rasterizer(dilation=DILATION).forward(
        np.concatenate([splats.centres, place[:, None]], 1),
        np.concatenate([splats.log_scales, np.full((n, 1), np.log(THINNEST), np.float32)], 1),
        np.stack([np.cos(splats.angles / 2), *np.zeros((2, n)), np.sin(splats.angles / 2)], 1).astype(np.float32),
        splats.opacity_logits,
        splats.colours,
        flat,
    )


def _ellipses(across: Float[Array, "n 3"], along: Float[Array, "n 3"]):
    """Logarithms of the standard deviations along the two axes of S, and the first one's angle."""
    a, b, c = (across**2).sum(1), (across * along).sum(1), (along**2).sum(1)
    major = 0.5 * (a + c) + np.hypot(0.5 * (a - c), b)
    area = (np.cross(across, along) ** 2).sum(1)
    minor = area / np.maximum(major, THINNEST**2)
    variances = np.maximum(np.stack([major, minor], 1), THINNEST**2)
    return (0.5 * np.log(variances)).astype(np.float32), (0.5 * np.arctan2(2 * b, a - c)).astype(np.float32)


def _fading_in(depth: Float[Array, "n"]) -> Float[Array, "n"]:
    share = np.clip((depth - SOFT[0]) / (SOFT[1] - SOFT[0]), 0, 1)
    return share * share * (3 - 2 * share)


def _scaled(logits: Float32[Array, "n"], share: Float[Array, "n"]) -> Float32[Array, "n"]:
    """Logits of the opacities times a share in (0, 1]; where that is 1 they keep their bits."""
    opacity = share / (1 + np.exp(-logits.astype(float)))
    with np.errstate(divide="ignore"):
        scaled = np.log(opacity) - np.log1p(-opacity)
    return np.where(share == 1, logits, scaled).astype(np.float32)
