"""A fit that is watched: how well it shows photos it has not seen, second by second.

Of photos every tenth by name, from the sixth, is for testing; of synthetic scenes those that ground.json names, by
group. Time spent on measuring is not counted.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.geometry.scene_frame import SceneFrame, Square, read_scene_frame
from dav_gswt.images import metrics
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground, read_training_view
from dav_gswt.reconstruction.coarse import Reconstruction, StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.fitting.trainer import FitOptions
from dav_gswt.reconstruction.ground import WHOLE

FIRST_TEST, EACH = 5, 10


@dataclass(frozen=True)
class PhotoSet:
    """A photos/ folder, split for a trial. tests: groups of test views by name."""

    frame: SceneFrame
    model: ColmapModel
    train: list[TrainingView]
    tests: dict[str, list[TrainingView]]
    margin: float = WHOLE


@dataclass(frozen=True)
class Trial:
    """What came out. curve: rows of seconds, step, psnr, psnr_colour_corrected and Gaussians."""

    made: Reconstruction
    curve: list[dict]


def read_photo_set(folder: Path | str, size: int, margin: float = WHOLE) -> PhotoSet:
    """Read a photos/ folder at a size, its test views apart.

    margin: see `fit_coarse_field`. All pixels of test views count where all ground that photos see is modelled (WHOLE);
    else those that look at the exemplar: at the border of what is modelled relief hides and shows what is not.
    """
    folder = Path(folder)
    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    known = {
        n: read_training_view(n, c, folder / "images" / n, size)
        for n, c in zip(model.names, model.cameras, strict=True)
    }
    names = sorted(known)
    groups = frame.test_groups or {"test": frame.test or names[FIRST_TEST::EACH]}
    out = {name for group in groups.values() for name in group}
    tests = {group: [known[n] for n in members] for group, members in groups.items()}
    if margin < WHOLE:
        tests = {group: _over_exemplar(views, frame.exemplar) for group, views in tests.items()}
    return PhotoSet(frame, model, [known[n] for n in names if n not in out], tests, margin)


def _over_exemplar(views: list[TrainingView], square: Square) -> list[TrainingView]:
    seen = [mask_outside_ground(v, square.west, square.south, square.east, square.north) for v in views]
    return [v for v in seen if v.weight.any()]


def profile_fit(photos: PhotoSet, settings: FitSettings, seed: int = 0, every: int = 25) -> Trial:
    """Fit the training photos, looking at the first group of test views every so many steps."""
    watched, measuring = next(iter(photos.tests.values())), 0.0
    start = time.perf_counter()
    curve: list[dict] = []
    drawn = raster.make_rasterizer()

    def watch(step: int, state) -> None:
        nonlocal measuring
        begun = time.perf_counter()
        row = {"seconds": begun - start - measuring, "step": step, "gaussians": len(state)}
        curve.append(row | measure_quality(lambda v: drawn.forward(**state.values, camera=v.camera).colour, watched))
        measuring += time.perf_counter() - begun

    rng = np.random.default_rng(seed)
    given = StartViews(photos.frame, photos.train, photos.model.points, photos.model.colours, photos.margin)
    made = fit_coarse_field(given, settings, rng, FitOptions(callback=watch, every=every))
    seconds = time.perf_counter() - start - measuring
    last = measure_quality(lambda v: raster.render(made.field, v.camera).colour, watched)
    curve.append({"seconds": seconds, "step": made.report.steps, "gaussians": len(made.field)} | last)
    return Trial(made, curve)


def measure_quality(
    draw: Callable[[TrainingView], Float32[Array, "h w 3"]], tests: list[TrainingView]
) -> dict[str, float]:
    """Mean PSNR of what is drawn, raw and colour-corrected, over the pixels of weight > 0."""
    raw, level = [], []
    for view in tests:
        seen = np.clip(draw(view), 0, 1)
        corrected = np.clip(metrics.correct_colours(seen, view.image, view.weight), 0, 1).astype(np.float32)
        raw.append(metrics.psnr(seen, view.image, view.weight))
        level.append(metrics.psnr(corrected, view.image, view.weight))
    return {"psnr": float(np.mean(raw)), "psnr_colour_corrected": float(np.mean(level))}


def find_time_to(curve: list[dict], decibel: float) -> float | None:
    """When the colour-corrected PSNR first reached so much; None: never."""
    reached = [row["seconds"] for row in curve if row["psnr_colour_corrected"] >= decibel]
    return reached[0] if reached else None
