"""Regression guard: an update may not show the earlier photos worse than before it by more than a bound.

A photo of a wrong pose or of another place contradicts the earlier ones, and a fit settles between them. The guard
compares how well the field shows each photo: PSNR after the exposure is fitted, over the pixels that count in the fit.
Losses above VISIBLE_PSNR cannot be seen and do not count: a field that shows a photo's noise may give that up.
"""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import log2

import numpy as np

from dav_gswt import raster
from dav_gswt.field import GaussianField
from dav_gswt.images import metrics
from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import to_raster_arrays
from dav_gswt.reconstruction.fitting.plan import FitPlan, FitReport
from dav_gswt.reconstruction.fitting.trainer import FitResult

_log = logging.getLogger(__name__)

# dB that the earlier photos may lose on average, and how much more for each doubling of the photos
ALLOWED_LOSS, LOSS_PER_DOUBLING = 1.5, 0.5
RETRIES = 2  # more fits of as many steps
VISIBLE_PSNR = 40.0  # dB: pixels differ by 2.6 of 255 grey levels
EQUAL_PSNR = 100.0  # dB that stand for equal pictures


@dataclass
class UpdateReport(FitReport):
    """What an update did, over all its fits.

    earlier_photos: number of the photos before it. psnr_before, psnr_after: their mean PSNR in dB; None without any.
    new_photos: names of its own photos. taken: whether the field is fitted to these.
    """

    earlier_photos: int = 0
    psnr_before: float | None = None
    psnr_after: float | None = None
    new_photos: list[str] = field(default_factory=list)
    taken: bool = True


def fit_with_guard(
    last: GaussianField,
    start: GaussianField,
    earlier: list[TrainingView],
    new: list[TrainingView],
    plan: FitPlan,
    fit: Callable[[GaussianField, FitPlan], FitResult],
) -> tuple[GaussianField, UpdateReport]:
    """Fit, and go on fitting, RETRIES times at most, while the earlier photos have lost too much.

    Args:
        last: From before the new photos; it is kept if the loss stays above the bound.
        start: What the fit starts from.
        fit: A fit to all views. Where no earlier photo has a pixel that counts, nothing can be lost.
    Returns: The field of the last fit, or the one from before, and the report.
    """
    most, seeing = allowed_loss(len(earlier), len(new)), [view for view in one_by_one(earlier) if view.weight.any()]
    before, fitted = measure_psnr(last, seeing), fit(start, plan)
    fits, reached = [fitted.report], measure_psnr(fitted.field, seeing)
    while (loss := mean_loss(before, reached)) > most and len(fits) <= RETRIES:
        _log.info("the earlier photos lost %.2f dB: fitting on", loss)
        fitted = fit(fitted.field, replace(plan, steps=fits[0].steps))
        fits.append(fitted.report)
        reached = measure_psnr(fitted.field, seeing)
    accepted = loss <= most
    if not accepted:
        _log.warning(
            "the new photos contradict the earlier ones: with %s the field shows those %.2f dB worse (bound: %.2g dB). "
            "The field from before is handed on, and no later fit sees these photos; is a pose wrong, or a photo of "
            "another place?",
            ", ".join(view.name for view in new),
            loss,
            most,
        )
    kept, after = (fitted.field, reached) if accepted else (last, before)
    level = [float(np.mean(values)) if values else None for values in (before, after)]
    effect = len(earlier), *level, [view.name for view in new], accepted
    return kept, UpdateReport(sum(each.steps for each in fits), len(kept), *effect)


def allowed_loss(earlier: int, new: int) -> float:
    """dB that so many earlier photos may lose to so many new ones."""
    return ALLOWED_LOSS + (LOSS_PER_DOUBLING * log2((earlier + new) / earlier) if earlier else 0.0)


def mean_loss(before: list[float], after: list[float]) -> float:
    """Mean loss of PSNR in dB, counted below VISIBLE_PSNR only; 0 without any value."""
    lost = np.minimum(before, VISIBLE_PSNR) - np.minimum(after, VISIBLE_PSNR)
    return float(lost.mean()) if len(lost) else 0.0


def list_rejected_photos(reports: Iterable[dict]) -> set[str]:
    """Names of the photos that contradicted earlier ones, by their rounds' fit.json."""
    return {name for report in reports if not report.get("taken", True) for name in report["new_photos"]}


def measure_psnr(field: GaussianField, views: list[TrainingView]) -> list[float]:
    """PSNR of each photo in dB over the pixels that count, after a gain and offset per channel."""
    rasterizer = raster.make_rasterizer()
    return [_psnr(rasterizer, field, view) for view in one_by_one(views)]


def _psnr(rasterizer: raster.Rasterizer, field: GaussianField, view: TrainingView) -> float:
    seen = rasterizer.forward(**to_raster_arrays(field), camera=view.camera)
    picture = seen.colour
    if view.behind is not None:
        picture = picture + (1 - seen.alpha)[..., None] * np.nan_to_num(view.behind)
    level = np.clip(metrics.correct_colours(np.clip(picture, 0, 1), view.image, view.weight), 0, 1)
    found = metrics.psnr(level.astype(np.float32), view.image, view.weight)
    return EQUAL_PSNR if found is None else min(EQUAL_PSNR, float(found))
