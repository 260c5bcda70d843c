"""Exposure of photos: gain and offset per photo and channel, anchored so that the set does not drift.

Fitted before the fit, between the photos' colours of the same points, and at every step, to the field's picture. Test
photos get none.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.images import channels
from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.reconstruction.fitting.photo_colours import median_colours, sample_colours

MAX_GAIN = 1.6  # of a photo against the set
MAX_STEP_GAIN = 1.25  # during the fit
LEARNING_RATE = np.float32(0.25)  # share of a step's estimate
PRIOR = 1e-3  # variance of pseudo-pixels of gain 1: a picture without contrast keeps its gain
TRIM = 3.0  # medians of the difference, beyond which a pixel is ignored
ROUNDS = 3
MAX_PIXELS = 8000  # evenly over the picture


def fit_gain_and_offset(
    x: Float[Array, "n 3"], y: Float[Array, "n 3"]
) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
    """Per channel the robust least-squares a, b of y = a x + b; a within 1 / MAX_GAIN .. MAX_GAIN.

    Pairs far off the first fit (three median deviations: moving things, blur) are left out of the second.
    """
    a, b = np.ones(3, np.float32), np.zeros(3, np.float32)
    for c in range(3):
        keep = np.isfinite(x[:, c]) & np.isfinite(y[:, c])
        for _ in range(2):
            u, v = x[keep, c].astype(float), y[keep, c].astype(float)
            if len(u) < 10:
                break
            spread = u.var() + 1e-6
            a[c] = np.clip(((u - u.mean()) * (v - v.mean())).mean() / spread, 1 / MAX_GAIN, MAX_GAIN)
            b[c] = v.mean() - a[c] * u.mean()
            residual = np.abs(a[c] * x[:, c] + b[c] - y[:, c])
            with np.errstate(invalid="ignore"):
                keep = residual < TRIM * 1.4826 * np.nanmedian(residual) + 1e-3
    return a, b


def equalize_exposure(views: list[TrainingView], points: Float[Array, "n 3"]) -> list[TrainingView]:
    """The photos at the exposure of the set.

    Each photo is fitted to the set's median colours of the ground points that it sees, in ROUNDS rounds. The anchor is
    the first median, so that gains multiply to about 1 and colours stay those of the typical photo.
    """
    anchor = None
    for _ in range(ROUNDS):
        median, _ = median_colours(points, views)
        if anchor is not None:  # without this the common gain random-walks from round to round
            back = fit_gain_and_offset(median, anchor)
            median = median * back[0] + back[1]
        anchor = median if anchor is None else anchor
        views = [match_exposure(view, points, median) for view in one_by_one(views)]
    return views


def match_exposure(view: TrainingView, points: Float[Array, "n 3"], colours: Float[Array, "n 3"]) -> TrainingView:
    """A photo with the gain and offset that fit it to known colours of points."""
    seen, _ = sample_colours(points, view)
    a, b = fit_gain_and_offset(seen, colours)
    return view.with_pixels(image=(view.image * a + b).astype(np.float32))


@dataclass(frozen=True)
class Sample:
    """The pixels of a photo that tell its exposure."""

    image: Float32[Array, "r c 3"]
    weight: Float32[Array, "r c"]


def thin(picture: Any, size: int) -> Any:
    """At most about MAX_PIXELS of a picture's `size` pixels, evenly; of an array or a tensor."""
    stride = max(1, int(np.sqrt(size / MAX_PIXELS)))
    return picture[::stride, ::stride]


def sample_photo(image: Float32[Array, "h w 3"], weight: Float32[Array, "h w"]) -> Sample:
    """The pixels of a photo that `thin` leaves."""
    return Sample(thin(image, weight.size), thin(weight, weight.size))


class ExposureTracker:
    """Gain and offset of each photo against the field's pictures, estimated step by step.

    They are used relative to their median over the photos, so that the field shows what the typical photo shows;
    otherwise a blurred picture, whose gain least squares finds below 1, would make the field's contrast grow at every
    step. A step moves a photo's values by the share LEARNING_RATE only: with all of it the field and the median, which
    is as old as the other photos' last steps, would oscillate.
    """

    def __init__(self, views: int):
        self.gains, self.offsets = np.ones((views, 3), np.float32), np.zeros((views, 3), np.float32)

    def update(self, index: int, picture: Float32[Array, "h w 3"], view: TrainingView) -> None:
        """Update a photo's values from the field's picture at its pose."""
        self.learn(index, thin(picture, view.weight.size), sample_photo(view.image, view.weight))

    def learn(self, index: int, picture: Float32[Array, "r c 3"], photo: Sample) -> None:
        """Update a photo's values from the thinned picture of the field (`thin`)."""
        a, b = update_gain_and_offset(picture, photo, (self.gains[index], self.offsets[index]))
        self.gains[index] += LEARNING_RATE * (a - self.gains[index])
        self.offsets[index] += LEARNING_RATE * (b - self.offsets[index])

    def gain_and_offset(self, index: int) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
        """Gain a and offset b that bring the picture x to the photo: a x + b; 1 and 0 before the first step."""
        a = self.gains[index] / np.median(self.gains, 0)
        return a, self.offsets[index] - a * np.median(self.offsets, 0)


def update_gain_and_offset(
    picture: Float32[Array, "r c 3"], photo: Sample, before: tuple[Float32[Array, "3"], Float32[Array, "3"]]
) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
    """Gain a and offset b that bring a picture to its photo, least squares over the pixels that count and agree.

    before: the photo's a and b at its last step; pixels that differ by more than TRIM medians under them (moving
    objects, objects that the field lacks) are ignored. a is held within 1 / MAX_STEP_GAIN .. MAX_STEP_GAIN by a prior
    and by clipping. If no pixel counts they stay unchanged.
    """
    image, weight = photo.image, photo.weight
    counts = weight > 0
    if not counts.any():
        return before
    apart = channels.largest_difference(channels.scale_channels(picture, *before), image)
    agrees = counts & (apart <= TRIM * np.median(apart[counts]))
    w = weight[agrees][:, None].astype(float)
    u, v, total = picture[agrees].astype(float), image[agrees].astype(float), float(w.sum()) + 1e-9
    x, y = (w * u).sum(0) / total, (w * v).sum(0) / total
    xx, xy = (w * u * u).sum(0) / total - x * x, (w * u * v).sum(0) / total - x * y
    a = np.clip((xy + PRIOR) / (np.maximum(xx, 0) + PRIOR), 1 / MAX_STEP_GAIN, MAX_STEP_GAIN)
    return a.astype(np.float32), (y - a * x).astype(np.float32)
