"""Discs of the ground layer and the things that stand on it, as Gaussians with colours from the photos."""

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial import cKDTree

from dav_gswt.coarse.ground import Ground
from dav_gswt.field import Field, sh_of
from dav_gswt.views import View

WIDTH = 0.72  # standard deviation of a disc in spacings: neighbours overlap, the ground is opaque (docs/deviations.md)
THICKNESS = 0.1  # of a disc, in spacings
OPAQUE = 4.0  # opacity logit of a disc before the first step
ALONE = 4.0  # spacings to its neighbours from which a point in the air is taken for a wrong match
STANDS = 1.5  # a point this many spacings above the surface is a thing


def quaternions(east: Float[Array, "n"], north: Float[Array, "n"]) -> Float32[Array, "n 4"]:
    """The shortest rotation (w x y z) that takes +z to the normal of a surface with these slopes."""
    normal = np.stack([-east, -north, np.ones_like(east)], 1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # half-way quaternion: (1 + z.n, z x n)
    q = np.stack([1 + normal[:, 2], -normal[:, 1], normal[:, 0], np.zeros(len(normal))], 1)
    return (q / np.linalg.norm(q, axis=1, keepdims=True)).astype(np.float32)


def ground_discs(grid: Ground, colours: Float[Array, "n 3"]) -> Field:
    """One disc a cell, tangent to the surface and stretched by its slope, so that none opens a hole downhill."""
    n = grid.heights.size
    east, north = (s.ravel() for s in grid.slopes())
    stretch = np.sqrt(1 + east**2 + north**2)
    scales = np.full((n, 3), WIDTH * grid.spacing) * np.stack([stretch, stretch, np.ones(n)], 1)
    scales[:, 2] = THICKNESS * grid.spacing
    return Field(
        grid.centres.astype(np.float32),
        np.log(scales).astype(np.float32),
        quaternions(east, north),
        np.full(n, OPAQUE, np.float32),
        sh_of(colours),
        np.where(grid.seen.ravel(), 0, 1).astype(np.float32),
        np.ones(n, bool),
    )


def things(grid: Ground, points: Float[Array, "n 3"], colours: Float[Array, "n 3"], band: float) -> Field:
    """Round Gaussians at the points that stand above the surface by more than the discs can follow, up to `band`."""
    inside = grid.contains(points)
    points, colours = points[inside], colours[inside]
    above = points[:, 2] - grid.height_at(points)
    stand = (above > STANDS * grid.spacing) & (above < band)
    points, colours = points[stand], colours[stand]
    apart = cKDTree(points).query(points, k=4)[0][:, 1:].mean(1) if len(points) > 3 else np.zeros(len(points))
    together = apart < ALONE * grid.spacing
    points, colours, apart = points[together], colours[together], apart[together]
    n = len(points)
    scales = np.clip(0.5 * apart, 0.5 * grid.spacing, 1.5 * grid.spacing)
    quats = np.zeros((n, 4), np.float32)
    quats[:, 0] = 1
    return Field(
        points.astype(np.float32),
        np.repeat(np.log(scales)[:, None], 3, 1).astype(np.float32),
        quats,
        np.zeros(n, np.float32),
        sh_of(colours),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def sampled(points: Float[Array, "n 3"], view: View) -> tuple[Float32[Array, "n 3"], Bool[Array, "n"]]:
    """The photo's colour at each point's pixel, and which points are inside the picture."""
    pixel, depth = view.camera.project(points)
    x, y = pixel[:, 0], pixel[:, 1]
    inside = (depth > 0) & (x >= 0.5) & (y >= 0.5) & (x < view.camera.width - 0.5) & (y < view.camera.height - 0.5)
    colours = np.full((len(points), 3), np.nan, np.float32)
    colours[inside] = view.image[y[inside].astype(int), x[inside].astype(int)]
    return colours, inside


def median_colours(
    points: Float[Array, "n 3"], views: list[View], chunk: int = 50_000
) -> tuple[Float32[Array, "n 3"], Bool[Array, "n"]]:
    """Median over the photos that see each point, and which points any photo sees (the others are NaN)."""
    colours = np.full((len(points), 3), np.nan, np.float32)
    for start in range(0, len(points), chunk):
        part = points[start : start + chunk]
        samples = np.stack([sampled(part, view)[0] for view in views])
        # sorting puts NaN last: the median is at half of the number that are not
        samples.sort(axis=0)
        count = np.isfinite(samples[..., 0]).sum(0)
        low, high = np.maximum(count - 1, 0) // 2, count // 2
        high = np.minimum(high, np.maximum(count - 1, 0))
        pick = np.arange(len(part))
        colours[start : start + chunk] = 0.5 * (samples[low, pick] + samples[high, pick])
    return colours, np.isfinite(colours[:, 0])


def filled(colours: Float[Array, "n 3"], known: Bool[Array, "rows columns"]) -> Float32[Array, "n 3"]:
    """Colours of unknown cells from the nearest known ones, blurred so that no streak shows; grey if none is known."""
    image = np.where(known[..., None], colours.reshape(*known.shape, 3), 0)
    if not known.any():
        return np.full((known.size, 3), 0.5, np.float32)
    if known.all():
        return image.reshape(-1, 3).astype(np.float32)
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    spread = image[tuple(nearest)]
    soft = np.stack([gaussian_filter(spread[..., c], 3.0, mode="nearest") for c in range(3)], -1)
    return np.where(known[..., None], image, soft).reshape(-1, 3).astype(np.float32)
