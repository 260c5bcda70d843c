"""Exposure of photos: gain and offset per photo and channel, anchored so that the set as a whole does not drift."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.coarse.discs import median_colours, sampled
from dav_gswt.views import View

GAIN = 1.6  # a photo brighter or darker than the set by more than this is left at the bound
ROUNDS = 3


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
                keep = residual < 3 * 1.4826 * np.nanmedian(residual) + 1e-3
    return a, b


def levelled(views: list[View], points: Float[Array, "n 3"]) -> list[View]:
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


def matched(view: View, points: Float[Array, "n 3"], colours: Float[Array, "n 3"]) -> View:
    """A photo whose gain and offset bring it to known colours of points."""
    seen, _ = sampled(points, view)
    a, b = gain_offset(seen, colours)
    return replace(view, image=(view.image * a + b).astype(np.float32))
