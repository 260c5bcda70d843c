"""Evaluation of a field on the test photos, which no other step uses."""

from collections.abc import Mapping, Sequence
from math import ceil

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.images import metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import make_rasterizer, to_raster_arrays

MEASURES = ("psnr", "psnr_colour_corrected", "ssim", "lpips")
WORST = 0.1  # of the views, at least one


def evaluate_field(
    field: GaussianField,
    tests: list[TrainingView],
    groups: Mapping[str, Sequence[str]] | None = None,
    weights: Weights | None = None,
) -> dict:
    """Mean PSNR (raw, colour-corrected), SSIM and LPIPS over the test views, over the pixels that look at the ground.

    groups: names of views that are also averaged by themselves (low, oblique). weights: of LPIPS; without them it is
    null. `worst_decile`: the mean of the worst tenth.
    A value is null without test views, and PSNR is where pictures are equal.
    """
    tests = [view for view in tests if view.weight.any()]
    pictures = make_rasterizer().forward_each(to_raster_arrays(field), [view.camera for view in tests])
    rows = [_evaluate_view(seen.colour, view, weights) for seen, view in zip(pictures, tests, strict=True)]
    named = {row["view"]: row for row in rows}
    parts = {group: [named[name] for name in names if name in named] for group, names in (groups or {}).items()}
    return _summarize(rows) | {"groups": {group: _summarize(part) for group, part in parts.items()}, "test_views": rows}


def _summarize(rows: list[dict]) -> dict:
    """The means of each measure over the rows, and over the worst tenth by that measure."""
    means, worst = {}, {}
    for key in MEASURES:
        values = [row[key] for row in rows]
        known = bool(values) and None not in values
        lowest = sorted(values, reverse=key == "lpips")[: ceil(WORST * len(values))] if known else []
        means[key], worst[key] = (float(np.mean(v)) if known else None for v in (values, lowest))
    return means | {"worst_decile": worst}


def _evaluate_view(colour: Float32[Array, "h w 3"], view: TrainingView, weights: Weights | None) -> dict:
    seen = np.clip(colour, 0, 1)
    level = np.clip(metrics.correct_colours(seen, view.image, view.weight), 0, 1).astype(np.float32)
    return {
        "view": view.name,
        "psnr": metrics.psnr(seen, view.image, view.weight),
        "psnr_colour_corrected": metrics.psnr(level, view.image, view.weight),
        "ssim": metrics.ssim(seen, view.image, view.weight),
        "lpips": None if weights is None else _lpips(seen, view, weights),
    }


def _lpips(seen: Float32[Array, "h w 3"], view: TrainingView, weights: Weights) -> float:
    """LPIPS of the picture, with the photo's pixels where none counts, over the share of pixels that count."""
    from dav_gswt.images import lpips  # deferred: torch takes seconds to load

    counts = (view.weight > 0)[..., None]
    picture = (2 * np.where(counts, seen, view.image) - 1)[None].astype(np.float32)
    photo = (2 * view.image - 1)[None].astype(np.float32)
    return float(lpips.distance(picture, photo, weights)[0] / counts.mean())
