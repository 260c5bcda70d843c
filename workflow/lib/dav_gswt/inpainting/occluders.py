"""Objects on inpainted ground, where the depth of the prior shows them from two sides or more."""

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry.cameras import Camera
from dav_gswt.inpainting import unseen
from dav_gswt.inpainting.view_inpainting import InpaintedViews
from dav_gswt.prior.interface import Condition
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views.candidates import Candidates

LEAST_HEIGHT = 0.05  # flying heights of an object above the ground; less is within the error of the depth
AGREEMENT = 0.03  # flying heights between the points of two views
LEAST_ALPHA = 0.9  # of a pixel of an object
SURROUNDINGS = 0.33  # pictures: size of the window in which the depths of prior and render are compared
LOGIT = 1.5  # opacity logit of the Gaussians
SPACING = 1.5  # of the Gaussians, in their scales


def find_occluders(
    field: GaussianField,
    grid: Ground,
    pool: Candidates,
    condition: Condition,
    views: InpaintedViews,
    flying_height: float,
) -> GaussianField:
    """Gaussians, one per pixel, of objects over inpainted ground on which at least two views agree; often none.

    The depth of a prior bends over a whole picture, so only what rises above its surroundings counts: the difference
    from the render's inverse depth, less the median of that difference around.
    """
    points, colours, sizes, sources = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, int)]
    for i, (_, camera) in enumerate(pool):
        inverse = _flatten_depth(condition.inverse_depth[i], views.inverse_depth[i])
        depth = flying_height / np.maximum(inverse, 1e-3)
        at, half_width = _unproject(camera, depth)
        height = at[..., 2] - grid.height_at(at.reshape(-1, 3)).reshape(depth.shape)
        rises = height > LEAST_HEIGHT * flying_height
        solid = rises & (views.alpha[i] > LEAST_ALPHA) & unseen.mask_pixels(field, field.imagined, camera)
        points.append(at[solid])
        colours.append(views.colour[i][solid].astype(float))
        sizes.append(half_width[solid])
        sources.append(np.full(int(solid.sum()), i))
    at, colour, size, source = (np.concatenate(part) for part in (points, colours, sizes, sources))
    agreed = _find_agreed(at, source, AGREEMENT * flying_height)
    return _make_gaussians(at[agreed], colour[agreed], size[agreed], field.sh.shape[1])


def _flatten_depth(render: Float32[Array, "s s"], inverse_depth: Float32[Array, "s s"]) -> Float32[Array, "s s"]:
    difference = inverse_depth - render
    return inverse_depth - median_filter(difference, size=int(SURROUNDINGS * len(difference)), mode="nearest")


def _unproject(camera: Camera, depth: Float32[Array, "s s"]) -> tuple[Float[Array, "s s 3"], Float[Array, "s s"]]:
    """The points of pixels, and half the width of a pixel there."""
    origins, steps = camera.rays()
    return origins + depth[..., None] * steps, 0.5 * depth.astype(float) / camera.fx


def _find_agreed(points: Float[Array, "n 3"], sources: Int[Array, "n"], distance: float) -> Bool[Array, "n"]:
    """The points that have a point of another view within a distance."""
    agreed = np.zeros(len(points), bool)
    for source in np.unique(sources):
        others = points[sources != source]
        if len(others):
            agreed[sources == source] = cKDTree(others).query(points[sources == source])[0] < distance
    return agreed


def _make_gaussians(
    points: Float[Array, "n 3"], colours: Float[Array, "n 3"], sizes: Float[Array, "n"], k: int
) -> GaussianField:
    """Isotropic Gaussians, one per cell of SPACING mean scales."""
    if len(points):
        cell = np.floor(points / (SPACING * sizes.mean())).astype(int)
        first = np.sort(np.unique(cell, axis=0, return_index=True)[1])
        points, colours, sizes = points[first], colours[first], sizes[first]
    n = len(points)
    sh = np.zeros((n, k, 3), np.float32)
    sh[:, :1] = rgb_to_sh(colours)
    return GaussianField(
        points.astype(np.float32),
        np.log(np.repeat(sizes[:, None], 3, 1)).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, LOGIT, np.float32),
        sh,
        np.ones(n, np.float32),
        np.zeros(n, bool),
        np.ones(n, bool),
    )
