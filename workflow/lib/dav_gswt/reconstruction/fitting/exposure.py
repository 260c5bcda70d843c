"""Exposure of photos: gain and offset per photo and channel, anchored so that the set does not drift.

Fitted before the fit, between the photos' colours of the same points, and at every step, to the field's picture. Test
photos get none.
"""

from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt import arrays
from dav_gswt.images import channels
from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.reconstruction.photo_colours import nan_median, sample_colours

MAX_GAIN = 1.6  # of a photo against the set
MAX_STEP_GAIN = 1.25  # during the fit
LEARNING_RATE = np.float32(0.25)  # share of a step's estimate
PRIOR = 1e-3  # variance of pseudo-pixels of gain 1: a picture without contrast keeps its gain
TRIM = 3.0  # medians of the difference, beyond which a pixel is ignored
ROUNDS = 3
CELL = 1 / 40  # of what is compared, of a cell whose mean colours are
WHOLE = 0.9  # of a cell's points, that a photo shows at least
LEVEL = 0.2  # weight of the square of the mean beside the variance
LEAST_PAIRS = 10  # colours that tell a photo's exposure
MAX_PIXELS = 8000  # evenly over the picture


def fit_gain_and_offset(
    x: Float[Array, "n 3"], y: Float[Array, "n 3"]
) -> tuple[Float32[Array, "3"], Float32[Array, "3"]]:
    """Per channel the robust a, b of y = a x + b; a within 1 / MAX_GAIN .. MAX_GAIN.

    a is the ratio of the standard deviations (the reduced major axis): both sides have errors, and a least-squares
    slope is the smaller the more x has. As exposure takes black to black, the means count in it as LEVEL of their
    squares: ground without contrast has no other ratio, and colours stay above 0. Pairs far off the first fit (three
    median deviations: moving things, blur) are left out of the second. Fewer than LEAST_PAIRS: 1 and 0.
    """
    a, b = np.ones(3, np.float32), np.zeros(3, np.float32)
    for c in range(3):
        keep = np.isfinite(x[:, c]) & np.isfinite(y[:, c])
        for _ in range(2):
            u, v = x[keep, c].astype(float), y[keep, c].astype(float)
            if len(u) < LEAST_PAIRS:
                break
            power = [each.var() + LEVEL * each.mean() ** 2 + 1e-6 for each in (u, v)]
            a[c] = np.clip(np.sqrt(power[1] / power[0]), 1 / MAX_GAIN, MAX_GAIN)
            b[c] = v.mean() - a[c] * u.mean()
            residual = np.abs(a[c] * x[:, c] + b[c] - y[:, c])
            with np.errstate(invalid="ignore"):
                keep = residual < TRIM * 1.4826 * np.nanmedian(residual) + 1e-3
    return a, b


def equalize_exposure(views: list[TrainingView], points: Float[Array, "n 3"]) -> list[TrainingView]:
    """The photos at the exposure of the set.

    Each photo is fitted to the set's median colours of the ground that it sees, in ROUNDS rounds. Colours are means
    over cells of the ground that are the same for all photos: grain a pixel beside its place would look like less
    contrast, and so would ground that is far away or seen at a slant, if each photo were averaged over its own pixels.
    Gains and offsets count relative to their median over the photos, so that the set keeps the colours and the contrast
    of its typical photo. Photos that see too little of the ground stay as they are.
    """
    cell_of, sizes = _divide_ground(points)
    seen = np.stack([_average_cells(points, view, cell_of, sizes) for view in one_by_one(views)])
    compared = np.isfinite(seen[..., 0]).sum(1) >= LEAST_PAIRS
    if not compared.any():
        return views
    gains, offsets = np.ones((len(views), 3), np.float32), np.zeros((len(views), 3), np.float32)
    for _ in range(ROUNDS):
        median = nan_median(seen[compared] * gains[compared, None] + offsets[compared, None])
        for i in np.flatnonzero(compared):
            gains[i], offsets[i] = fit_gain_and_offset(seen[i], median)
        gain, offset = np.median(gains[compared], 0), np.median(offsets[compared], 0)
        gains[compared] = gains[compared] / gain
        offsets[compared] = (offsets[compared] - offset) / gain
    return [
        view.with_pixels(image=(view.image * a + b).astype(np.float32))
        for view, a, b in zip(one_by_one(views), gains, offsets, strict=True)
    ]


def _divide_ground(points: Float[Array, "n 3"]) -> tuple[Int[Array, "n"], Int[Array, "cells"]]:
    """The cell of the map that each point lies in, CELL of what most points span; and how many points each cell has."""
    low, high = np.quantile(points[:, :2], [0.05, 0.95], axis=0)
    side = CELL * max(float((high - low).max()), 1e-9)
    index = np.floor((points[:, :2] - low) / side).astype(np.int64)
    _, cell_of = np.unique(index, axis=0, return_inverse=True)
    return cell_of.ravel(), np.bincount(cell_of.ravel())


def _average_cells(
    points: Float[Array, "n 3"], view: TrainingView, cell_of: Int[Array, "n"], sizes: Int[Array, "cells"]
) -> Float32[Array, "cells 3"]:
    """A photo's mean colours of cells; NaN where it does not see nearly all of their points."""
    colours, inside = sample_colours(points, view)
    own = cell_of[inside]
    total = np.stack([np.bincount(own, colours[inside, c].astype(float), len(sizes)) for c in range(3)], 1)
    count = np.bincount(own, minlength=len(sizes))
    mean = (total / np.maximum(count, 1)[:, None]).astype(np.float32)
    mean[count < WHOLE * sizes] = np.nan
    return mean


Sample = tuple[Float32[Any, "r c 3"], Float32[Any, "r c"]]  # pixels of a photo, with their weights


def thin(picture: Any) -> Any:
    """At most about MAX_PIXELS of a picture's pixels, evenly."""
    stride = max(1, int(np.sqrt(picture.shape[0] * picture.shape[1] / MAX_PIXELS)))
    return picture[::stride, ::stride]


class ExposureTracker:
    """Gain and offset of each photo against the field's pictures, estimated step by step.

    They are used relative to their median over the photos, so that the field shows what the typical photo shows;
    otherwise a blurred picture, whose gain least squares finds below 1, would make the field's contrast grow at every
    step. A step moves a photo's values by the share LEARNING_RATE only: with all of it the field and the median, which
    is as old as the other photos' last steps, would oscillate.
    """

    def __init__(self, views: int):
        self.gains: Any = np.ones((views, 3), np.float32)
        self.offsets: Any = np.zeros((views, 3), np.float32)

    def learn(
        self, index: int, picture: Float32[Any, "r c 3"], image: Float32[Any, "r c 3"], weight: Float32[Any, "r c"]
    ) -> None:
        """Update a photo's values from the thinned picture of the field (`thin`)."""
        a, b = update_gain_and_offset(picture, (image, weight), (self.gains[index], self.offsets[index]))
        self.gains[index] += (a - self.gains[index]) * LEARNING_RATE
        self.offsets[index] += (b - self.offsets[index]) * LEARNING_RATE

    def gain_and_offset(self, index: int) -> tuple[Float32[Any, "3"], Float32[Any, "3"]]:
        """Gain a and offset b that bring the picture x to the photo: a x + b; 1 and 0 before the first step."""
        a = self.gains[index] / arrays.median(self.gains)
        return a, self.offsets[index] - a * arrays.median(self.offsets)


def update_gain_and_offset(
    picture: Float32[Any, "r c 3"], photo: Sample, before: tuple[Float32[Any, "3"], Float32[Any, "3"]]
) -> tuple[Float32[Any, "3"], Float32[Any, "3"]]:
    """Gain a and offset b that bring a picture to its photo, least squares over the pixels that count and agree.

    before: the photo's a and b at its last step; pixels that differ by more than TRIM medians under them (moving
    objects, objects that the field lacks) are ignored. a is held within 1 / MAX_STEP_GAIN .. MAX_STEP_GAIN by a prior
    and by clipping. If no pixel counts they stay unchanged.
    """
    xp = arrays.namespace(picture)
    apart = abs(channels.scale_channels(picture, *before) - photo[0])
    apart = xp.maximum(xp.maximum(apart[..., 0], apart[..., 1]), apart[..., 2]).reshape(-1)
    weight = photo[1].reshape(-1)
    agrees = (weight > 0) & (apart <= TRIM * arrays.median(apart, weight > 0))
    w = arrays.to_double(weight * agrees)[:, None]
    u, v = (arrays.to_double(image.reshape(-1, 3)) for image in (picture, photo[0]))
    total = w.sum() + 1e-9
    x, y = (w * u).sum(0) / total, (w * v).sum(0) / total
    xx, xy = (w * u * u).sum(0) / total - x * x, (w * u * v).sum(0) / total - x * y
    a = xp.clip((xy + PRIOR) / (xp.clip(xx, 0, None) + PRIOR), 1 / MAX_STEP_GAIN, MAX_STEP_GAIN)
    known = (weight > 0).any()
    new = arrays.to_single(a), arrays.to_single(y - a * x)
    return xp.where(known, new[0], before[0]), xp.where(known, new[1], before[1])
