"""Visibility: which points a photo sees, and the ground behind them.

Where a photo sees the ground, nothing stands between. Kutulakos and Seitz (2000) carve space by photos alone; here the
ground's height is known, and one ray through a point is enough.
"""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.reconstruction.ground import Ground

ITERATIONS = 3  # of the intersection of a ray with the ground
CHUNK = 4_000_000  # points times photos at a time


def median_behind(
    grid: Ground,
    values: Float32[Array, "rows columns"],
    places: Float32[Array, "n 3"],
    views: list[TrainingView],
    least: int,
) -> Float32[Array, "n"]:
    """Per point, the median of the ground's values behind it over the photos that see it.

    values: NaN where unknown. The result is NaN where fewer than `least` photos see ground with a value.
    """
    size = max(1, CHUNK // len(views))
    parts = [places[start : start + size] for start in range(0, len(places), size)]
    return np.concatenate(
        [np.zeros(0, np.float32), *(_median_behind(grid, values, part, views, least) for part in parts)]
    )


def _median_behind(grid: Ground, values: Array, places: Array, views: list[TrainingView], least: int) -> Array:
    found = np.full((len(views), len(places)), np.nan, np.float32)
    for row, view in zip(found, one_by_one(views), strict=True):
        rotation, translation = (np.asarray(a, np.float32) for a in (view.camera.rotation, view.camera.translation))
        sees = project_visible(view, places @ rotation.T + translation)[0]
        cells, hit = _intersect_ground(grid, -rotation.T @ translation, places[sees])
        row[sees[hit]] = values.ravel()[cells[hit]]
    found.sort(0)  # NaN is sorted last
    number = np.isfinite(found).sum(0)
    middle = np.stack([np.maximum(number - 1, 0) // 2, np.minimum(number // 2, len(views) - 1)])
    median = np.take_along_axis(found, middle, 0).mean(0)
    return np.where(number >= least, median, np.float32(np.nan))


def project_visible(
    view: TrainingView, q: Float32[Array, "n 3"]
) -> tuple[Array, Float32[Array, "m"], Float32[Array, "m"]]:
    """Rows of the points (in the camera's frame) where the photo counts, and their columns and rows in pixels, from the
    first pixel's centre; each has a neighbour to the right and below."""
    camera = view.camera
    per_z = 1 / np.where(q[:, 2] > 1e-6, q[:, 2], np.inf)
    x, y = (np.float32(f) * q[:, k] * per_z + np.float32(c - 0.5) for k, f, c in _lens(camera))
    inside = (q[:, 2] > 1e-6) & (x >= 0) & (y >= 0) & (x < camera.width - 1) & (y < camera.height - 1)
    rows = np.flatnonzero(inside)
    x, y = x[rows], y[rows]
    counts = view.weight[y.astype(np.int32), x.astype(np.int32)] > 0
    return rows[counts], x[counts], y[counts]


def _intersect_ground(grid: Ground, eye: Float32[Array, "3"], places: Float32[Array, "n 3"]) -> tuple[Array, Array]:
    """Cells of the ground that rays from an eye through points meet, and which rays meet any."""
    rows, columns = grid.shape
    down = places - eye
    falls = down[:, 2] < 0
    fall = np.where(falls, down[:, 2], -1)
    z, cell, inside = grid.height_at(places), np.zeros(len(places), np.int64), falls
    for _ in range(ITERATIONS):
        at = eye + ((z - eye[2]) / fall)[:, None] * down
        row, column = np.floor((at[:, 1] - grid.south) / grid.spacing), np.floor((at[:, 0] - grid.west) / grid.spacing)
        inside = falls & (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        cell = (np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1)).astype(np.int64)
        z = grid.heights.ravel()[cell]
    return cell, inside


def _lens(camera):
    return (0, camera.fx, camera.cx), (1, camera.fy, camera.cy)
