"""Exposure of photos: gain and offset per photo and channel, anchored so that the set as a whole does not drift.

Twice: once before the fit, from what the photos say of the same points, and then at every step, from the picture that
the field gives now. A test photo gets none.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction.fitting.photo_colours import median_colours, sampled

GAIN = 1.6  # a photo brighter or darker than the set by more than this is left at the bound
STEP_GAIN = 1.25  # the same for what is left to correct during the fit
LEARNT = np.float32(0.25)  # share of what a turn says of a photo's level
PRIOR = 1e-3  # variance of made-up pixels with gain 1: a picture without contrast says nothing of its gain
TRIM = 3.0  # pixels further off than this many medians of the difference say nothing of the exposure
ROUNDS = 3
ENOUGH = 8000  # pixels, evenly over the picture, to know its exposure by


def gain_offset(x: Float[Array, "n 3"], y: Float[Array, "n 3"]) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
    """Per channel the robust least-squares a, b of y = a x + b; a within 1 / GAIN .. GAIN.

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
            a[c] = np.clip(((u - u.mean()) * (v - v.mean())).mean() / spread, 1 / GAIN, GAIN)
            b[c] = v.mean() - a[c] * u.mean()
            residual = np.abs(a[c] * x[:, c] + b[c] - y[:, c])
            with np.errstate(invalid="ignore"):
                keep = residual < TRIM * 1.4826 * np.nanmedian(residual) + 1e-3
    return a, b


def levelled(views: list[TrainingView], points: Float[Array, "n 3"]) -> list[TrainingView]:
    """The photos with their exposure brought to that of the set.

    Each photo is fitted to the median colour that the set gives the ground points it sees, three times over; the
    anchor is the first median, so gains multiply to about 1 and the colours stay those of the typical photo.
    """
    anchor = None
    for _ in range(ROUNDS):
        median, _ = median_colours(points, views)
        if anchor is not None:  # without this the common gain random-walks from round to round
            back = gain_offset(median, anchor)
            median = median * back[0] + back[1]
        anchor = median if anchor is None else anchor
        views = [matched(view, points, median) for view in views]
    return views


def matched(view: TrainingView, points: Float[Array, "n 3"], colours: Float[Array, "n 3"]) -> TrainingView:
    """A photo whose gain and offset bring it to known colours of points."""
    seen, _ = sampled(points, view)
    a, b = gain_offset(seen, colours)
    return replace(view, image=(view.image * a + b).astype(np.float32))


class Levels:
    """Gain and offset of each photo against the pictures that the field gave at its turns.

    What is used of them is anchored: the median over the photos is taken out, so that the field shows what the typical
    photo shows. Without this a picture that is not yet sharp, whose gain least squares finds below 1, would make the
    field's contrast and brightness grow at every step. A turn changes a photo's level by a share (LEARNT) only: the
    median is as old as the other photos' last turns, and would it follow the field at once, the two would chase each
    other, the wider the more photos there are.
    """

    def __init__(self, views: int):
        self.gains, self.offsets = np.ones((views, 3), np.float32), np.zeros((views, 3), np.float32)

    def look(self, index: int, picture: Float32[Array, "h w 3"], view: TrainingView) -> None:
        """Learn of a photo's level from the picture of its place."""
        a, b = towards(picture, view, (self.gains[index], self.offsets[index]))
        self.gains[index] += LEARNT * (a - self.gains[index])
        self.offsets[index] += LEARNT * (b - self.offsets[index])

    def of(self, index: int) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
        """Gain a and offset b that bring the picture x to the photo: a x + b; 1 and 0 where nothing is learnt yet."""
        a = self.gains[index] / np.median(self.gains, 0)
        return a, self.offsets[index] - a * np.median(self.offsets, 0)


def towards(
    picture: Float32[Array, "h w 3"], view: TrainingView, before: tuple[Float32[Array, "3"], Float32[Array, "3"]]
) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
    """Gain a and offset b that bring a picture to its photo, least squares over the pixels that count and agree.

    before: this photo's a and b of its last turn; pixels that differ by more than TRIM medians under them (things that
    move, things that the field does not know yet) have no vote. a is held within 1 / STEP_GAIN .. STEP_GAIN by a prior
    and a bound; no pixel that counts: unchanged.
    """
    stride = max(1, int(np.sqrt(view.weight.size / ENOUGH)))
    some = np.s_[::stride, ::stride]
    picture, image, weight = picture[some], view.image[some], view.weight[some]
    counts = weight > 0
    if not counts.any():
        return before
    apart = np.abs(picture * before[0] + before[1] - image).max(-1)
    agrees = counts & (apart <= TRIM * np.median(apart[counts]))
    w = weight[agrees][:, None].astype(float)
    u, v, total = picture[agrees].astype(float), image[agrees].astype(float), float(w.sum()) + 1e-9
    x, y = (w * u).sum(0) / total, (w * v).sum(0) / total
    xx, xy = (w * u * u).sum(0) / total - x * x, (w * u * v).sum(0) / total - x * y
    a = np.clip((xy + PRIOR) / (np.maximum(xx, 0) + PRIOR), 1 / STEP_GAIN, STEP_GAIN)
    return a.astype(np.float32), (y - a * x).astype(np.float32)
