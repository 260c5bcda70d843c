"""Evaluation of inpainting: test photos before and after, over all pixels and over those of inpainted ground."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.inpainting import unseen
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import evaluation


def evaluate_inpainting(
    before: GaussianField, after: GaussianField, tests: list[TrainingView], weights: Weights | None = None
) -> dict:
    """Metrics of the field before and after, over `all` pixels of the modelled ground and over those of `imagined`
    (inpainted) ground alone, and the number of pixels.

    The pixels are the same before and after: those that look at the inpainted discs. tests: weighted, see
    `observation.mask_to_ground`.
    Returns: the content of metrics.json; null under `imagined` if no test photo sees such ground.
    """
    inpainted = after.imagined[: len(before)]
    views = {"all": tests, "imagined": [_mask_view(view, before, inpainted) for view in tests]}
    metrics = {
        part: {
            "before": evaluation.evaluate_field(before, masked, weights=weights),
            "after": evaluation.evaluate_field(after, masked, weights=weights),
            "pixels": int(sum((view.weight > 0).sum() for view in masked)),
        }
        for part, masked in views.items()
    }
    return metrics | {"gaussians": {"before": len(before), "after": len(after), "imagined": int(after.imagined.sum())}}


def _mask_view(view: TrainingView, field: GaussianField, inpainted: Bool[Array, "n"]) -> TrainingView:
    looks = unseen.mask_pixels(field, inpainted, view.camera)
    return replace(view, weight=np.where(looks, view.weight, np.float32(0)))
