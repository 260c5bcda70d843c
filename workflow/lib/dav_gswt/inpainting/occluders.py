"""What stands on ground that no photo saw: only where a prior's depth says so from at least two sides."""

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry.cameras import Camera
from dav_gswt.inpainting import unseen
from dav_gswt.inpainting.paint import Painted
from dav_gswt.prior.interface import Condition
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views.candidates import Candidates

RISES = 0.05  # flying heights above the ground from which something is a thing: less is within the depth's error
AGREE = 0.03  # flying heights between the places that two views give it
SOLID = 0.9  # opacity of a pixel that shows one
AROUND = 0.33  # pictures: how far around a pixel the prior's depth is compared with the ground's
LOGIT = 1.5  # opacity logit of its Gaussians
APART = 1.5  # their distance, in deviations of one


def things(
    field: GaussianField, grid: Ground, pool: Candidates, condition: Condition, made: Painted, flying_height: float
) -> GaussianField:
    """Gaussians, one a pixel, of what at least two views agree to stand over imagined ground; often none.

    A prior's depth bends over a whole picture, so only what rises above its surroundings counts: the difference from
    the render's inverse depth, less that difference's median around.
    """
    points, colours, sizes, views = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, int)]
    for i, (_, camera) in enumerate(pool):
        depth = flying_height / np.maximum(_inverse(condition.inverse_depth[i], made.inverse_depth[i]), 1e-3)
        at, across = _places(camera, depth)
        rises = at[..., 2] - grid.height_at(at.reshape(-1, 3)).reshape(depth.shape) > RISES * flying_height
        there = rises & (made.alpha[i] > SOLID) & unseen.looking(field, field.imagined, camera)
        points.append(at[there])
        colours.append(made.colour[i][there].astype(float))
        sizes.append(across[there])
        views.append(np.full(int(there.sum()), i))
    at, colour, size, view = (np.concatenate(part) for part in (points, colours, sizes, views))
    agreed = _agreed(at, view, AGREE * flying_height)
    return _gaussians(at[agreed], colour[agreed], size[agreed], field.sh.shape[1])


def _inverse(ground: Float32[Array, "s s"], told: Float32[Array, "s s"]) -> Float32[Array, "s s"]:
    apart = told - ground
    return told - median_filter(apart, size=int(AROUND * len(apart)), mode="nearest")


def _places(camera: Camera, depth: Float32[Array, "s s"]) -> tuple[Float[Array, "s s 3"], Float[Array, "s s"]]:
    """Where pixels of a depth are, and half a pixel's width there."""
    origins, steps = camera.rays()
    return origins + depth[..., None] * steps, 0.5 * depth.astype(float) / camera.fx


def _agreed(points: Float[Array, "n 3"], views: Array, near: float) -> Bool[Array, "n"]:
    """Which points have one of another view near."""
    found = np.zeros(len(points), bool)
    for view in np.unique(views):
        others = points[views != view]
        if len(others):
            found[views == view] = cKDTree(others).query(points[views == view])[0] < near
    return found


def _gaussians(
    points: Float[Array, "n 3"], colours: Float[Array, "n 3"], sizes: Float[Array, "n"], k: int
) -> GaussianField:
    """Round Gaussians, of those nearer than APART one."""
    if len(points):
        cell = np.floor(points / (APART * sizes.mean())).astype(int)
        first = np.sort(np.unique(cell, axis=0, return_index=True)[1])
        points, colours, sizes = points[first], colours[first], sizes[first]
    n = len(points)
    sh = np.zeros((n, k, 3), np.float32)
    sh[:, :1] = rgb_to_sh(colours)
    return GaussianField(
        points.astype(np.float32),
        np.log(np.repeat(sizes[:, None], 3, 1)).astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        np.full(n, LOGIT, np.float32),
        sh,
        np.ones(n, np.float32),
        np.zeros(n, bool),
        np.ones(n, bool),
    )
