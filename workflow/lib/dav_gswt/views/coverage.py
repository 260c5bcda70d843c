"""Directional coverage: how well photos show each cell of the ground, from how many sides.

A photo shows cell g in n_g pixels (sums of blend weights, so what hides a cell counts) from a direction d_g. Photos of
a cell from one side say little of how it looks from another, so each counts for directions b near its own:

    K_gb = sum over photos of n_g exp((cos(d_g, b) - 1) / w^2),  value of the photos = sum of a_g log(1 + K_gb).

The logarithm is the information of repeated measurements: the first good look at a cell is worth most, a photo from
half the distance as much as four. The sum is monotone and submodular, so greedy choice reaches 1 - 1/e of the best.
a_g says how much a cell matters: equal for all, or how wrong the field still shows it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import metrics
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import Rasterizer, make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction.ground import Ground

CELLS = 28  # along the longer side of the ground that counts
WIDTH = 18.0  # w, degrees: a photo counts for directions about as near as this
BELTS = ((12.0, 8), (35.0, 6), (70.0, 3))  # directions b: elevation in degrees, and how many around; low: for walkers
ERROR_WIDTH = 128  # pixels across a photo that is compared with its render: finer differences are noise
LEAST_PIXELS = 1.0  # blend weight from which a cell counts as seen


@dataclass(frozen=True)
class CellViews:
    """What n cameras see of the cells. centres: of the cameras. pixels: in which each cell is shown."""

    centres: Float64[Array, "n 3"]
    pixels: Float32[Array, "n cells"]


class GroundCells:
    """The ground that counts (`Ground.judged`) in square cells, row by row, each with the Gaussians over it."""

    def __init__(self, field: GaussianField, grid: Ground):
        west, south, east, north = grid.judged
        side = max(east - west, north - south) / CELLS
        self.shape = max(1, round((north - south) / side)), max(1, round((east - west) / side))
        column, row = np.floor((field.means[:, :2] - [west, south]) / side).astype(int).T
        inside = (row >= 0) & (row < self.shape[0]) & (column >= 0) & (column < self.shape[1])
        self.field, self.members = field, np.flatnonzero(inside)
        self.of = (row * self.shape[1] + column)[inside]
        count = np.maximum(self.sum(np.ones(len(field))), 1)
        self.middle = np.stack([self.sum(axis) / count for axis in field.means.astype(float).T], 1)

    def __len__(self) -> int:
        return self.shape[0] * self.shape[1]

    def sum(self, values: Float[Array, "gaussians"]) -> Float64[Array, "cells"]:
        """Sum a value of Gaussians over each cell."""
        return np.bincount(self.of, values[self.members], len(self))

    def average(self, values: Float[Array, "gaussians"]) -> Float64[Array, "cells"]:
        """Mean of a value of Gaussians over each cell, by opacity; 0 where a cell has none."""
        weight = expit(self.field.opacity_logits.astype(float))
        return self.sum(weight * values) / np.maximum(self.sum(weight), 1e-9)

    def view(self, cameras: list[Camera]) -> CellViews:
        """Render the field for each camera and count the pixels that show each cell."""
        raster, arrays, pixels = make_rasterizer(), to_raster_arrays(self.field), []
        for _ in raster.forward_each(arrays, cameras):
            pixels.append(self.count_pixels(raster))
        return self.gather_views(cameras, pixels)

    def count_pixels(self, raster: Rasterizer) -> Float32[Array, "cells"]:
        """Pixels that show each cell in the picture that a rasterizer made last."""
        return self.sum(raster.contributions().total.astype(float)).astype(np.float32)

    def gather_views(self, cameras: list[Camera], pixels: list[Float32[Array, "cells"]]) -> CellViews:
        """What cameras see, from the pixels of each."""
        centres = np.array([camera.centre for camera in cameras], float)
        return CellViews(centres.reshape(-1, 3), np.array(pixels, np.float32).reshape(-1, len(self)))


def measure_cell_errors(
    cells: GroundCells, views: list[TrainingView], corrected: bool = False
) -> Float64[Array, "cells"]:
    """Mean squared error of the field's renders of photos, in each cell; of cells in no photo the greatest of all.

    The error of a pixel belongs to the Gaussians that make it, by their blend weights. Photos are compared ERROR_WIDTH
    pixels wide. corrected: fit gain and offset of each channel to the photo first (photos differ in exposure).
    """
    raster, arrays = make_rasterizer(), to_raster_arrays(cells.field)
    wrong, pixels = np.zeros((2, len(cells)))
    for view, picture in zip(views, raster.forward_each(arrays, [view.camera for view in views]), strict=True):
        seen = np.clip(picture.colour, 0, 1)
        if corrected and view.weight.any():
            seen = np.clip(metrics.correct_colours(seen, view.image, view.weight), 0, 1)
        squares = view.weight * ((seen - view.image) ** 2).mean(-1)
        found = raster.contributions(np.ascontiguousarray(np.stack([squares, view.weight], -1), np.float32))
        wrong += cells.sum(found.mapped[:, 0].astype(float))
        pixels += cells.sum(found.mapped[:, 1].astype(float))
    known = pixels > LEAST_PIXELS
    error = np.where(known, wrong / np.maximum(pixels, LEAST_PIXELS), 0.0)
    return np.where(known, error, error.max())


def compute_gain(
    importance: Float[Array, "cells"], known: Float[Array, "cells b"], added: Float[Array, "cells b"]
) -> float:
    """Sum of a_g log((1 + K_gb + more) / (1 + K_gb)): what a photo adds to K, exact where it adds little."""
    return float(importance.astype(np.float64) @ np.log1p(added.astype(np.float64) / (1 + known)).sum(1))


class DirectionalCoverage:
    """Gain of candidates in directional coverage, updated with every choice."""

    def __init__(
        self,
        cells: GroundCells,
        taken: CellViews,
        candidates: CellViews,
        importance: Float[Array, "cells"] | None = None,
    ):
        """taken, candidates: at the scoring size. importance: a_g, of any scale; None, or 0 for all: equal."""
        weight = np.ones(len(cells)) if importance is None or not importance.any() else importance
        if not (np.isfinite(weight).all() and (weight >= 0).all()):
            raise ValueError("the importance of a cell must be a number of at least 0")
        self.importance = weight / weight.mean()
        self.candidates, self._middle, self._directions = candidates, cells.middle, list_directions()
        self.known = np.zeros((len(cells), len(self._directions)))
        for i in range(len(taken.pixels)):
            self.known += self._spread_over_directions(taken, i)

    def gains(self) -> list[float]:
        """Return the gain of every candidate."""
        return [self.gain(i) for i in range(len(self.candidates.pixels))]

    def gain(self, i: int) -> float:
        """Return the gain of a photo from candidate i over all photos so far."""
        return compute_gain(self.importance, self.known, self._spread_over_directions(self.candidates, i))

    def take(self, i: int) -> None:
        """Add the photo from candidate i."""
        self.known = self.known + self._spread_over_directions(self.candidates, i)

    def _spread_over_directions(self, views: CellViews, i: int) -> Float64[Array, "cells b"]:
        """Pixels of one picture that show each cell, as they count for each direction."""
        way = views.centres[i] - self._middle
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
        return views.pixels[i][:, None] * np.exp((way @ self._directions.T - 1) / np.radians(WIDTH) ** 2)


def list_directions() -> Float64[Array, "b 3"]:
    """Unit vectors b, from the ground outwards."""
    elevation = np.radians([e for e, count in BELTS for _ in range(count)])
    azimuth = np.concatenate([2 * np.pi * np.arange(count) / count for _, count in BELTS])
    level = np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], 1)
