"""Colours of world points in the photos."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.training_views import TrainingView, one_by_one

CHUNK = 1_200_000  # colours of points at a time, over all photos
LARGEST = 50_000  # points at a time, so that they stay in the cache


def sample_colours(points: Float[Array, "n 3"], view: TrainingView) -> tuple[Float32[Array, "n 3"], Bool[Array, "n"]]:
    """The photo's colour at each point's pixel, and which points are inside the picture and count there."""
    pixel, depth = view.camera.project(points)
    x, y = pixel[:, 0], pixel[:, 1]
    inside = (depth > 0) & (x >= 0.5) & (y >= 0.5) & (x < view.camera.width - 0.5) & (y < view.camera.height - 0.5)
    row, column = y[inside].astype(int), x[inside].astype(int)
    inside[inside] = view.weight[row, column] > 0
    colours = np.full((len(points), 3), np.nan, np.float32)
    colours[inside] = view.image[y[inside].astype(int), x[inside].astype(int)]
    return colours, inside


def sample_all_views(points: Float[Array, "n 3"], views: list[TrainingView]) -> Float32[Array, "v n 3"]:
    """Every photo's colours of the points; NaN where it does not see them."""
    return np.stack([sample_colours(points, view)[0] for view in one_by_one(views)])


def chunk_points(points: Float[Array, "n 3"], views: list[TrainingView]) -> Iterator[Float[Array, "m 3"]]:
    """The points in parts, the smaller the more photos there are."""
    size = max(1, min(LARGEST, CHUNK // max(1, len(views))))
    return (points[start : start + size] for start in range(0, len(points), size))


def median_colours(
    points: Float[Array, "n 3"], views: list[TrainingView]
) -> tuple[Float32[Array, "n 3"], Bool[Array, "n"]]:
    """Median colour of each point over the photos that see it (NaN without any), and which points a photo sees."""
    found = [nan_median(sample_all_views(part, views)) for part in chunk_points(points, views)]
    colours = np.concatenate([np.zeros((0, 3), np.float32), *found])
    return colours, np.isfinite(colours[:, 0])


def nan_median(values: Float32[Array, "v n c"]) -> Float32[Array, "n c"]:
    """Median over the first axis, ignoring NaN; NaN where all values are."""
    ordered = np.sort(values, axis=0)  # NaN goes last: the median is at half of the number that are not
    count = np.isfinite(ordered[..., 0]).sum(0)
    pick, last = np.arange(values.shape[1]), np.maximum(count - 1, 0)
    return 0.5 * (ordered[last // 2, pick] + ordered[np.minimum(count // 2, last), pick])
