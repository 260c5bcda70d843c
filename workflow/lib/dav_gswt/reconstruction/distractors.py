"""Distractors: moving objects (a kite's line, a shadow, a person), which disagree with all other photos of the ground.

Where at least MIN_PHOTOS photos see a point and agree, a photo that differs far from their median shows a distractor,
and its pixels do not count. Points where all photos differ, as on a shrub, are kept.
"""

import logging

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation

from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.reconstruction.fitting.photo_colours import chunk_points, nan_median, sample_all_views

_log = logging.getLogger(__name__)

MIN_PHOTOS = 4  # that see a point
MAX_DEVIATIONS = 6.0  # median deviations from the median
MIN_DIFFERENCE = 0.12  # of the range of colours
MAX_SHARE = 0.2  # of a photo's pixels: more is not a distractor, but a photo that fits nowhere


def mask_distractors(views: list[TrainingView], points: Float[Array, "n 3"]) -> list[TrainingView]:
    """The views with weight 0 where they disagree with the others on the surface's points."""
    masks = [np.zeros(v.image.shape[:2], bool) for v in views]
    for part in chunk_points(points, views):
        seen = sample_all_views(part, views)
        for view, mask, odd in zip(views, masks, find_disagreeing(seen), strict=True):
            pixel, _ = view.camera.project(part[odd])
            mask[pixel[:, 1].astype(int), pixel[:, 0].astype(int)] = True
    out = []
    for view, mask in zip(one_by_one(views), masks, strict=True):
        mask = binary_dilation(mask, np.ones((3, 3), bool)) if mask.any() else mask
        share = float(mask.mean())
        if share > MAX_SHARE:
            _log.warning("%s differs from the other photos over %.0f %% of its pixels", view.name, 100 * share)
        elif share > 0:
            _log.info("%s: %.2f %% of its pixels show what no other photo shows", view.name, 100 * share)
            view = view.with_pixels(weight=view.weight * ~mask)
        out.append(view)
    return out


def find_disagreeing(seen: Float[Array, "v n 3"]) -> Bool[Array, "v n"]:
    """Which samples differ far from the median of their point, where the others agree."""
    count = np.isfinite(seen[..., 0]).sum(0)
    apart = np.abs(seen - nan_median(seen)).max(-1)
    spread = nan_median(apart[..., None])[:, 0]
    with np.errstate(invalid="ignore"):
        return (count >= MIN_PHOTOS) & (apart > np.maximum(MAX_DEVIATIONS * spread, MIN_DIFFERENCE))
