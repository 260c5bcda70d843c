"""Colours of world points in the photos, which points a photo sees, and the ground behind them.

Where a photo sees the ground, nothing stands between. Kutulakos and Seitz (2000) carve space by photos alone; here the
ground's height is known, and one ray through a point is enough.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates

from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import backends
from dav_gswt.reconstruction.ground import Ground

CHUNK = 1_200_000  # colours of points at a time, over all photos
LARGEST = 50_000  # points at a time, so that they stay in the cache
ITERATIONS = 3  # of the intersection of a ray with the ground


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


@dataclass(frozen=True)
class ColourSums:
    """Over the photos that see a point: sum of its colours, sum of their squares, and how many photos these are."""

    total: Float32[Array, "h n 3"]
    squares: Float32[Array, "h n"]
    count: Float32[Array, "h n"]

    def deviations(self) -> Float32[Array, "h n"]:
        """Standard deviation of the colours over the photos, all channels together; means nothing below two."""
        number = np.maximum(self.count, 2)
        mean = self.total[..., 0] ** 2 + self.total[..., 1] ** 2 + self.total[..., 2] ** 2
        return np.sqrt(np.maximum((self.squares - mean / number) / (number - 1), 0))


def sum_colours(views: list[TrainingView], places: Float32[Array, "n 3"], heights: Float32[Array, "h"]) -> ColourSums:
    """Sums over the photos of their bilinear colours of places moved up by each height.

    The core computes them where it is built, else NumPy.
    """
    shape = len(heights), len(places)
    sums = ColourSums(*(np.zeros(s, np.float32) for s in ((*shape, 3), shape, shape)))
    add = _add_by_numpy if backends.explain_unavailable("cpu") else _add_by_core
    for view in one_by_one(views):
        add(view, places, heights, sums)
    return sums


def _add_by_core(view: TrainingView, places: Array, heights: Array, sums: ColourSums) -> None:
    from dav_gswt.raster import cpu  # deferred: where it is built

    image, weight = np.ascontiguousarray(view.image), np.ascontiguousarray(view.weight)
    cpu.add_colours(image, weight, view.camera, places, heights, (sums.total, sums.squares, sums.count))


def _add_by_numpy(view: TrainingView, places: Array, heights: Array, sums: ColourSums) -> None:
    start, up = to_camera(places, view), view.camera.rotation[:, 2].astype(np.float32)
    for k, height in enumerate(heights):
        rows, x, y = project_visible(view, start + height * up)
        channels = np.moveaxis(view.image, -1, 0)
        colours = np.stack([map_coordinates(channel, [y, x], order=1) for channel in channels], 1)
        sums.total[k, rows] += colours
        sums.squares[k, rows] += np.einsum("nc,nc->n", colours, colours)
        sums.count[k, rows] += 1


def to_camera(places: Float32[Array, "n 3"], view: TrainingView) -> Float32[Array, "n 3"]:
    """World points in the camera's frame, float32."""
    return places @ view.camera.rotation.T.astype(np.float32) + view.camera.translation.astype(np.float32)


def project_visible(
    view: TrainingView, q: Float32[Array, "n 3"]
) -> tuple[Array, Float32[Array, "m"], Float32[Array, "m"]]:
    """Rows of the points (in the camera's frame) where the photo counts, and their columns and rows in pixels, from the
    first pixel's centre; each has a neighbour to the right and below."""
    camera = view.camera
    per_z = 1 / np.where(q[:, 2] > 1e-6, q[:, 2], np.inf)
    lens = (0, camera.fx, camera.cx), (1, camera.fy, camera.cy)
    x, y = (np.float32(f) * q[:, k] * per_z + np.float32(c - 0.5) for k, f, c in lens)
    inside = (q[:, 2] > 1e-6) & (x >= 0) & (y >= 0) & (x < camera.width - 1) & (y < camera.height - 1)
    rows = np.flatnonzero(inside)
    x, y = x[rows], y[rows]
    counts = view.weight[y.astype(np.int32), x.astype(np.int32)] > 0
    return rows[counts], x[counts], y[counts]


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
    medians = [_median_behind(grid, values, part, views, least) for part in chunk_points(places, views)]
    return np.concatenate([np.zeros(0, np.float32), *medians])


def _median_behind(grid: Ground, values: Array, places: Array, views: list[TrainingView], least: int) -> Array:
    found = np.full((len(views), len(places)), np.nan, np.float32)
    for row, view in zip(found, one_by_one(views), strict=True):
        rotation, translation = (np.asarray(a, np.float32) for a in (view.camera.rotation, view.camera.translation))
        sees = project_visible(view, to_camera(places, view))[0]
        cells, hit = _intersect_ground(grid, -rotation.T @ translation, places[sees])
        row[sees[hit]] = values.ravel()[cells[hit]]
    number = np.isfinite(found).sum(0)
    return np.where(number >= least, nan_median(found[..., None])[:, 0], np.float32(np.nan))


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
