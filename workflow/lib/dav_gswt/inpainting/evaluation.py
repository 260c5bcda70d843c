"""What completing a field was worth: test photos before and after, everywhere and where it was painted."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.inpainting import unseen
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import evaluation


def judged(
    before: GaussianField, after: GaussianField, tests: list[TrainingView], weights: Weights | None = None
) -> dict:
    """Metrics (`evaluation.evaluate`) over `all` pixels that look at the ground, and over those that look at `imagined`
    ground alone, of the field before and after; how many pixels that is.

    The pixels are the same for both: those that look at the discs that were painted. tests: weighted, see
    `observation.mask_to_ground`. Returns: null in `imagined` where no test photo looks at any.
    """
    painted = after.imagined[: len(before)]
    views = {"all": tests, "imagined": [_over(view, before, painted) for view in tests]}
    out = {
        part: {
            "before": evaluation.evaluate_field(before, seen, weights=weights),
            "after": evaluation.evaluate_field(after, seen, weights=weights),
            "pixels": int(sum((view.weight > 0).sum() for view in seen)),
        }
        for part, seen in views.items()
    }
    return out | {"gaussians": {"before": len(before), "after": len(after), "imagined": int(after.imagined.sum())}}


def _over(view: TrainingView, field: GaussianField, painted: Bool[Array, "n"]) -> TrainingView:
    looks = unseen.looking(field, painted, view.camera)
    return replace(view, weight=np.where(looks, view.weight, np.float32(0)))
