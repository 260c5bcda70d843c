"""A fit that is watched: how well it shows photos it has not seen, second by second.

Every tenth photo by name, from the sixth, is for testing. Time spent on measuring is not counted.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import metrics
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.photos.training_views import TrainingView, read_training_view
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.fitting.trainer import FitOptions
from dav_gswt.reconstruction.ground import WHOLE

FIRST_TEST, EACH = 5, 10


@dataclass(frozen=True)
class PhotoSet:
    """A photos/ folder, split for a trial."""

    frame: SceneFrame
    model: ColmapModel
    train: list[TrainingView]
    tests: list[TrainingView]

    def start_views(self) -> StartViews:
        """The training photos and all points, as a fit takes them; all ground that photos see is modelled."""
        return StartViews(self.frame, self.train, self.model.points, self.model.colours, WHOLE)


def read_photo_set(folder: Path | str, size: int) -> PhotoSet:
    """Read a photos/ folder at a size, its test views apart."""
    folder = Path(folder)
    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    known = {
        n: read_training_view(n, c, folder / "images" / n, size)
        for n, c in zip(model.names, model.cameras, strict=True)
    }
    names = sorted(known)
    out = names[FIRST_TEST::EACH]
    return PhotoSet(frame, model, [known[n] for n in names if n not in out], [known[n] for n in out])


def profile_fit(photos: PhotoSet, settings: FitSettings, seed: int = 0, every: int = 25) -> list[dict]:
    """Fit the training photos, looking at the test views every so many steps and at the end.

    Returns: rows of seconds, processor_seconds (of all threads), step, psnr, psnr_colour_corrected and Gaussians.
    """
    measuring, start = np.zeros(2), _read_clocks()
    curve: list[dict] = []
    drawn = raster.make_rasterizer()

    def watch(step: int, state) -> None:
        nonlocal measuring
        begun = _read_clocks()
        seconds, used = (begun - start - measuring).tolist()
        row = {"seconds": seconds, "processor_seconds": used, "step": step, "gaussians": len(state)}
        measured = measure_quality(lambda v: drawn.forward(**state.values, camera=v.camera).colour, photos.tests)
        curve.append(row | measured)
        measuring += _read_clocks() - begun

    rng = np.random.default_rng(seed)
    made = fit_coarse_field(photos.start_views(), settings, rng, FitOptions(callback=watch, every=every))
    seconds, used = (_read_clocks() - start - measuring).tolist()
    row = {"seconds": seconds, "processor_seconds": used, "step": made.report.steps, "gaussians": len(made.field)}
    return [*curve, row | measure_quality(lambda v: raster.render(made.field, v.camera).colour, photos.tests)]


def _read_clocks() -> Float[Array, "2"]:
    """Seconds by the clock, and of all threads of this process."""
    return np.array([time.perf_counter(), time.process_time()])


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
