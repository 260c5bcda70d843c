"""Which photos of a set are blurred: those with much less fine detail than the set's sharp ones."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.threads import map_ahead

SIDE = 2000  # pixels along the longer side at which photos are compared
FAR = 8  # pixels
BLUR = 0.6  # a picture with less than this share of the usual fine detail is blurred
USUAL = 80  # percentile of all pictures that is usual
GREY = np.array([0.299, 0.587, 0.114], np.float32)  # Rec. 601


def find_blurred(paths: Sequence[Path], threads: int) -> Bool[Array, "n"]:
    """Which of the photos are blurred, by their detail at SIDE pixels. threads: change no result."""
    grey = partial(image_files.read_shrunk_photo, longest=SIDE)
    detail = [*map_ahead(lambda path: measure_detail(grey(path) @ GREY), progress(paths, "look for blur"), threads)]
    return np.array(detail) < find_threshold(np.array(detail))


def measure_detail(grey: Float32[Array, "h w"]) -> float:
    """The least share, over four directions, of the contrast between neighbouring pixels in that of pixels FAR apart.

    Motion blurs along one direction, and a lens out of focus along all; the ratio hardly depends on what is shown.
    """
    shares = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        near, far = (_contrast(grey, dy * step, dx * step) for step in (1, FAR))
        shares.append(near / far if far > 0 else 0.0)
    return min(shares)


def find_threshold(detail: Float[Array, "n"], blur: float = BLUR) -> float:
    """The detail below which a picture of a set is blurred. blur: that share of the usual detail."""
    return blur * float(np.percentile(detail, USUAL))


def _contrast(grey: Float32[Array, "h w"], dy: int, dx: int) -> float:
    h, w = grey.shape
    first = grey[: h - dy, max(0, -dx) : w - max(0, dx)]
    second = grey[dy:, max(0, dx) : w + min(0, dx)]
    return float(np.abs(second - first).mean())
