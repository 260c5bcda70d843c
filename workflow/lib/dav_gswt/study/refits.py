"""The path of rounds: photos taken in rounds against one fit to all of them, with the same number of steps.

Photos are a start and further ones, each the farthest from those before. All photos that no fit takes are for testing.
"""

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray as Array

from dav_gswt.geometry.poses import pose_of_camera, select_farthest_poses
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.photos.colmap_model import read_colmap_model, triangulate_points
from dav_gswt.photos.training_views import TrainingView, read_training_views
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction import evaluation
from dav_gswt.reconstruction.coarse import Reconstruction, StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.update import UpdateInput, update_field

COLUMNS = ("photos", "photos_a_round", "first_rate", "seed", "steps", *evaluation.MEASURES, "gaussians", "seconds")


@dataclass(frozen=True)
class RefitPhotos:
    """views: the photos in the order they are taken. points: the matched points of the first n, and
    their colours."""

    frame: SceneFrame
    views: list[TrainingView]
    tests: list[TrainingView]
    points: Callable[[int], tuple[Array, Array]]
    margin: float


@dataclass(frozen=True)
class RefitSettings:
    """start: photos of the first fit. weights: of LPIPS; without them it is not measured."""

    coarse: FitSettings
    update: FitSettings
    start: int
    weights: Weights | None


def read_refit_photos(folder: Path | str, split: ViewSplit, photos: int, size: int, margin: float) -> RefitPhotos:
    """The photos of a photos/ folder at a size, until there are as many as `photos`; the rest of the pool is tested."""
    folder = Path(folder)
    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    pool = [pose_of_camera(name, model.camera(name), frame) for name in split.pool]
    taken = np.array([model.camera(name).centre - frame.exemplar.centre for name in split.start])
    order = [*split.start, *(split.pool[i] for i in select_farthest_poses(pool, len(pool), taken))]
    views = read_training_views(folder / "images", folder / "sparse", order[:photos], [], size)
    tests = read_training_views(folder / "images", folder / "sparse", [*split.test, *order[photos:]], [], size)
    return RefitPhotos(frame, views, tests, lambda n: triangulate_points(model, order[:n], folder / "images"), margin)


def compare_refits(
    photos: RefitPhotos,
    settings: RefitSettings,
    photos_a_round: Sequence[int],
    first_rates: Sequence[float],
    seeds: Sequence[int],
) -> list[dict]:
    """A row of COLUMNS for the first fit, for one fit to all photos, and for each size of rounds and first rate.

    Seconds are of the processor, over all fits of a row. The one fit has the steps that the rounds have together.
    """
    rows, everything = [], len(photos.views)
    steps = settings.coarse.plan_coarse_fit(settings.start).steps
    steps += settings.update.steps_per_photo * (everything - settings.start)
    for seed in seeds:
        first = _fit(photos, settings.coarse, settings.start, seed)
        rows.append(_describe(photos, settings, first, {"photos": settings.start, "seed": seed}))
        once = _fit(photos, replace(settings.coarse, steps=steps, steps_per_photo=0), everything, seed)
        rows.append(_describe(photos, settings, once, {"photos": everything, "seed": seed}))
        for size, rate in itertools.product(photos_a_round, first_rates):
            update = replace(settings.update, first_rate=rate)
            last = _refit(photos, update, first, range(settings.start, everything, size), seed)
            case = {"photos": everything, "photos_a_round": size, "first_rate": rate, "seed": seed}
            rows.append(_describe(photos, settings, last, case))
    return rows


@dataclass(frozen=True)
class _Fitted:
    """A field with its ground, and the steps and seconds of the processor that it took."""

    made: Reconstruction
    steps: int
    seconds: float


def _fit(photos: RefitPhotos, settings: FitSettings, count: int, seed: int) -> _Fitted:
    """The first fit, to the first photos."""
    begun = time.process_time()
    points, colours = photos.points(count)
    start = StartViews(photos.frame, photos.views[:count], points, colours, photos.margin)
    made = fit_coarse_field(start, settings, np.random.default_rng(seed))
    return _Fitted(made, settings.plan_coarse_fit(count).steps, time.process_time() - begun)


def _refit(photos: RefitPhotos, settings: FitSettings, first: _Fitted, starts: range, seed: int) -> _Fitted:
    """The rounds after the first fit; each takes the photos from one of the starts to the next."""
    last = first
    for t, n in enumerate(starts, 1):
        begun, field = time.process_time(), last.made.field
        new = photos.views[n : n + starts.step]
        given = UpdateInput(field, last.made.grid, photos.frame, photos.views[:n], new)
        made = update_field(given, settings, np.random.default_rng([seed, t]))
        steps = last.steps + settings.steps_per_photo * len(new)
        last = _Fitted(made, steps, last.seconds + time.process_time() - begun)
    return last


def _describe(photos: RefitPhotos, settings: RefitSettings, fitted: _Fitted, case: dict) -> dict:
    field, grid = fitted.made.field, fitted.made.grid
    found = evaluation.evaluate_field(field, mask_to_ground(photos.tests, grid), weights=settings.weights)
    measured = {name: found[name] for name in evaluation.MEASURES}
    cost = {"steps": fitted.steps, "gaussians": len(field), "seconds": fitted.seconds}
    return dict.fromkeys(COLUMNS) | case | measured | cost
