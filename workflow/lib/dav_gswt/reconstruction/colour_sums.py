"""Sums of the photos' colours of points at several heights: by the core where it is built, else by NumPy."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import backends
from dav_gswt.reconstruction import visibility


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
    """Sums over the photos of their bilinear colours of places moved up by each height."""
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
    camera = view.camera
    start = places @ camera.rotation.T.astype(np.float32) + camera.translation.astype(np.float32)
    for k, height in enumerate(heights):
        rows, colours = _sample_bilinear(view, start + height * camera.rotation[:, 2].astype(np.float32))
        sums.total[k, rows] += colours
        sums.squares[k, rows] += np.einsum("nc,nc->n", colours, colours)
        sums.count[k, rows] += 1


def _sample_bilinear(view: TrainingView, q: Float32[Array, "n 3"]) -> tuple[Array, Float32[Array, "m 3"]]:
    """Rows of the points (in the camera's frame) that the photo sees, and its colours there."""
    camera = view.camera
    rows, x, y = visibility.project_visible(view, q)
    column, row = x.astype(np.int32), y.astype(np.int32)
    right, down = ((at - cell).astype(np.float32)[:, None] for at, cell in ((x, column), (y, row)))
    flat, at = view.image.reshape(-1, 3), row * camera.width + column
    top = flat[at] * (1 - right) + flat[at + 1] * right
    bottom = flat[at + camera.width] * (1 - right) + flat[at + camera.width + 1] * right
    return rows, top * (1 - down) + bottom * down
