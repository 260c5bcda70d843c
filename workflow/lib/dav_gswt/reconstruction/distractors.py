"""What moves between photos (a kite's line, a shadow, a person) disagrees with all other photos of the same ground.

Only where at least LEAST photos see a place, and only where the others agree: there a photo that differs from their
median by far shows something that is not the ground's, and its pixels do not count. What differs from every side, as a
shrub does, is nobody's fault and stays.
"""

import logging
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation

from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction.fitting.photo_colours import CHUNK, middle, samples

_log = logging.getLogger(__name__)

LEAST = 4  # photos that see a place
FAR = 6.0  # median deviations from the median
LEAST_FAR = 0.12  # and at least so much of the range of colours
MOST = 0.2  # of a photo's pixels: more is no distractor, but a photo that fits nowhere


def without(views: list[TrainingView], points: Float[Array, "n 3"]) -> list[TrainingView]:
    """The views with weight 0 where they disagree with all others about the surface's points."""
    masks = [np.zeros(v.image.shape[:2], bool) for v in views]
    for start in range(0, len(points), CHUNK):
        part = points[start : start + CHUNK]
        seen = samples(part, views)
        for view, mask, odd in zip(views, masks, disagreeing(seen), strict=True):
            pixel, _ = view.camera.project(part[odd])
            mask[pixel[:, 1].astype(int), pixel[:, 0].astype(int)] = True
    out = []
    for view, mask in zip(views, masks, strict=True):
        mask = binary_dilation(mask, np.ones((3, 3), bool)) if mask.any() else mask
        share = float(mask.mean())
        if share > MOST:
            _log.warning("%s differs from the other photos over %.0f %% of its pixels", view.name, 100 * share)
        elif share > 0:
            _log.info("%s: %.2f %% of its pixels show what no other photo shows", view.name, 100 * share)
            view = replace(view, weight=view.weight * ~mask)
        out.append(view)
    return out


def disagreeing(seen: Float[Array, "v n 3"]) -> Bool[Array, "v n"]:
    """Which samples differ from the median of their point by far, where the others agree."""
    count = np.isfinite(seen[..., 0]).sum(0)
    apart = np.abs(seen - middle(seen)).max(-1)
    spread = middle(apart[..., None])[:, 0]
    with np.errstate(invalid="ignore"):
        return (count >= LEAST) & (apart > np.maximum(FAR * spread, LEAST_FAR))
