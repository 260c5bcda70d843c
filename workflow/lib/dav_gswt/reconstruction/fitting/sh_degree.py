"""The degree of the spherical harmonics: the lowest that held-out pixels need."""

from collections.abc import Callable
from functools import reduce

import numpy as np

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import harmonics
from dav_gswt.reconstruction.fitting.held_out import MIN_GAIN
from dav_gswt.reconstruction.fitting.plan import FitReport
from dav_gswt.reconstruction.fitting.state import State


def choose_degree(now: State, cameras: list[Camera], score: Callable[[State], float], report: FitReport) -> State:
    """The state of the lowest degree that loses less than MIN_GAIN.

    cameras: of the photos. score: PSNR of held-out pixels, dB.
    """
    tried = {degree: reduce_degree(now, degree, cameras) for degree in range(now.sh_degree)} | {now.sh_degree: now}
    scores = {degree: score(state) for degree, state in tried.items()}
    report.held_out += [{"degree": degree, "psnr": round(value, 3)} for degree, value in scores.items()]
    chosen = min(degree for degree, value in scores.items() if value > max(scores.values()) - MIN_GAIN)
    gain = scores[now.sh_degree] - scores[0]
    report.note_choice("degree", chosen, f"degree {now.sh_degree} is worth {gain:+.3f} dB on held-out pixels")
    return tried[chosen]


def reduce_degree(full: State, degree: int, cameras: list[Camera]) -> State:
    """A state of a lower degree; the constant takes the mean of the dropped terms over the photos' directions."""
    k = (degree + 1) ** 2
    colours, means = full.values["colours"], full.values["means"].astype(float)
    bases = (harmonics.basis(harmonics.directions(means, camera), full.sh_degree) for camera in cameras)
    mean = reduce(np.add, (basis / len(cameras) for basis in bases))
    out = full.copy()
    out.resize_sh(degree)
    dropped = np.einsum("nk,nkc->nc", mean[:, k:], colours[:, k:])
    out.values["colours"][:, 0] += (dropped / mean[:, :1]).astype(np.float32)
    return out
