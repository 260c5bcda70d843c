"""The ground layer: one flat Gaussian (disc) a cell."""

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.reconstruction.ground import Ground

WIDTH = 0.72  # standard deviation of a disc in spacings: neighbours overlap, the ground is opaque
THICKNESS = 0.1  # of a disc, in spacings
OPAQUE = 4.0  # opacity logit of a disc before the first step
OBJECT_HEIGHT = 1.5  # spacings above the surface, from which a Gaussian belongs to an object


def slopes_to_quaternions(east: Float[Array, "n"], north: Float[Array, "n"]) -> Float32[Array, "n 4"]:
    """The shortest rotation (w x y z) from +z to the normal of a surface with these slopes."""
    length = np.sqrt(east * east + north * north + 1)  # of the normal (-east, -north, 1)
    # half-way quaternion: (1 + z.n, z x n); column after column, as NumPy is slow along an axis of 3
    w, x, y = 1 + 1 / length, north / length, -east / length
    size = np.sqrt(w * w + x * x + y * y)
    out = np.zeros((len(east), 4), np.float32)
    out[:, 0], out[:, 1], out[:, 2] = w / size, x / size, y / size
    return out


def make_ground_discs(grid: Ground, colours: Float[Array, "n 3"]) -> GaussianField:
    """One disc a cell, tangent to the surface and stretched by its slope, so that slopes have no holes."""
    n = grid.heights.size
    east, north = (s.ravel() for s in grid.slopes())
    stretch = np.sqrt(1 + east**2 + north**2)
    scales = np.full((n, 3), WIDTH * grid.spacing) * np.stack([stretch, stretch, np.ones(n)], 1)
    scales[:, 2] = THICKNESS * grid.spacing
    return GaussianField(
        grid.centres.astype(np.float32),
        np.log(scales).astype(np.float32),
        slopes_to_quaternions(east, north),
        np.full(n, OPAQUE, np.float32),
        rgb_to_sh(colours),
        np.where(grid.seen.ravel(), 0, 1).astype(np.float32),
        np.ones(n, bool),
    )


def fill_unknown(colours: Float[Array, "n 3"], known: Bool[Array, "rows columns"]) -> Float32[Array, "n 3"]:
    """Colours with unknown cells filled from the nearest known ones and blurred; grey if none is known."""
    image = np.where(known[..., None], colours.reshape(*known.shape, 3), 0)
    if not known.any():
        return np.full((known.size, 3), 0.5, np.float32)
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    spread = image[tuple(nearest)]
    soft = np.stack([gaussian_filter(spread[..., c], 3.0, mode="nearest") for c in range(3)], -1)
    return np.where(known[..., None], image, soft).reshape(-1, 3).astype(np.float32)
