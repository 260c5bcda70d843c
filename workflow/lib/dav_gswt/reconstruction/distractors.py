"""Distractors: moving objects (a kite's line, a shadow, a person), which disagree with all other photos of the ground.

Where at least MIN_PHOTOS photos see a point and agree, a photo that differs far from their median shows a distractor,
and its pixels do not count. Points where all photos differ, as on a shrub, are kept.
"""

import logging

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import maximum_filter

from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.reconstruction.fitting.photo_colours import chunk_points, nan_median, sample_all_views

_log = logging.getLogger(__name__)

MIN_PHOTOS = 4  # that see a point
MAX_DEVIATIONS = 6.0  # median deviations from the median
MIN_DIFFERENCE = 0.12  # of the range of colours
NOTABLE_SHARE = 0.2  # of a photo's pixels, beyond which the log warns: a large shadow, or a wrong place


def mask_distractors(views: list[TrainingView], points: Float[Array, "n 3"], spacing: float) -> list[TrainingView]:
    """The views with weight 0 where they disagree with the others on the surface's points, `spacing` apart."""
    masks = [np.zeros(v.image.shape[:2], bool) for v in views]
    reach = [1] * len(views)  # pixels around a point that are its own
    for part in chunk_points(points, views):
        seen = sample_all_views(part, views)
        for i, odd in enumerate(find_disagreeing(seen)):
            if odd.any():
                pixel, depth = views[i].camera.project(part[odd])
                masks[i][pixel[:, 1].astype(int), pixel[:, 0].astype(int)] = True
                wide = spacing * views[i].camera.fx / float(np.median(depth))
                reach[i] = max(reach[i], int(np.ceil(wide / 2)))
    out = []
    for view, mask, own in zip(one_by_one(views), masks, reach, strict=True):
        mask = maximum_filter(mask, 2 * own + 1, mode="constant") if mask.any() else mask
        share = float(mask.mean())
        if share > NOTABLE_SHARE:
            said = "%s differs from the other photos over %.0f %% of its pixels, which do not count"
            _log.warning(said, view.name, 100 * share)
        elif share > 0:
            _log.info("%s: %.2f %% of its pixels show what no other photo shows", view.name, 100 * share)
        if share > 0:
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
