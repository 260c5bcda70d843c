"""Stopping rule of the rounds: a budget of photos, or a least expected gain.

All rounds are planned in advance. Rounds after the stop request no pose and pass the field on unchanged.

The gain is predicted from captured photos only; no test photo is used. A field shows the photos that it was fitted to
better than others. This gap shrinks with their number, and each new photo measures it before the field is fitted to it.
Test views gain about half of what the gap loses.
"""

import logging
from dataclasses import asdict, dataclass

import numpy as np
from scipy.special import ndtri, stdtrit  # scipy.stats has them too, but loads for longer than most jobs take

from dav_gswt.files import read_json
from dav_gswt.views.selection import read_pose_selection

_log = logging.getLogger(__name__)

LEVEL = 0.95  # of the interval
LEAST = 3  # new photos needed for an estimate
SHARE = 0.5  # of the closed gap that test views gain, measured on development scenes
SPREAD = 0.4  # standard deviation of the logarithm of SHARE between experiments
SCENES = 4  # behind both constants; the interval uses Student's t for so few


@dataclass(frozen=True)
class ExpectedGain:
    """Expected gain of the next `photos` photos together in dB, and the ends of its 95 % interval. closes: dB of the
    gap that they close; `gain` is a share of it."""

    photos: int
    gain: float
    low: float
    high: float
    closes: float

    @property
    def each(self) -> float:
        """dB per photo."""
        return self.gain / self.photos


def predict_gain(gaps: list[float], fitted: int, coming: int) -> ExpectedGain | None:
    """Predict the gain of a field fitted to `fitted` = n photos from `coming` = k more.

    gaps: see `build_history`. Model: the gap is c / n, with c estimated from all new photos so far; k photos close
    c (1 / n - 1 / (n + k)) of it, and test views gain SHARE of that. The interval is of the logarithm: normal for c,
    Student's t for SHARE on one more scene, t_(SCENES - 1) SPREAD sqrt(1 + 1 / SCENES). If c <= 0 the gain is 0, and
    its upper end follows from c alone.
    Returns: None with fewer than LEAST new photos so far, or none to come.
    """
    if len(gaps) < LEAST or coming < 1:
        return None
    n, k, z = fitted, coming, float(ndtri((1 + LEVEL) / 2))
    part = 1 / n - 1 / (n + k)
    c, error = float(np.mean(gaps)), float(np.std(gaps, ddof=1) / np.sqrt(len(gaps)))
    if not c > 0:
        return ExpectedGain(k, 0.0, 0.0, SHARE * part * max(0.0, c + z * error), 0.0)
    scene = float(stdtrit(SCENES - 1, (1 + LEVEL) / 2)) * SPREAD * np.sqrt(1 + 1 / SCENES)
    gain, wide = SHARE * part * c, float(np.exp(np.hypot(scene, z * error / c)))
    return ExpectedGain(k, gain, gain / wide, gain * wide, part * c)


def build_history(reports: list[dict], start: int) -> tuple[list[float], int]:
    """How much worse new photos were shown than earlier ones, and how many photos the field is fitted to now.

    The gaps are dB below the earlier photos' mean, times the number of photos that the field was fitted to then.
    reports: of the rounds so far (fit.json). start: photos before the first round. Rejected photos are left out: the
    field was never fitted to them.
    """
    gaps, fitted = [], start
    for report in reports:
        new, earlier = report["new_views"], report["earlier_views"]
        if new["taken"] and new["photos"]:
            level = earlier["psnr_before"]
            unseen = [row["psnr_before"] for row in new["views"] if row["psnr_before"] is not None]
            gaps += [] if level is None else [fitted * (level - value) for value in unseen]
            fitted += new["photos"]
    return gaps, fitted


@dataclass(frozen=True)
class StoppingState:
    """Input of a decision.

    start, taken: photos before the first round, and so far. fits: fit.json of the rounds so far. candidates: number of
    remaining candidates. stopped: reason why the previous round stopped, else None.
    """

    start: int
    taken: int
    fits: list[dict]
    candidates: int
    stopped: str | None = None


@dataclass(frozen=True)
class Decision:
    """poses: number to request. stopped: reason why none is requested, else None. expected: gain of these poses, or of
    the ones no longer requested; None if it cannot be predicted."""

    poses: int
    stopped: str | None
    expected: ExpectedGain | None

    def expected_gain(self) -> dict | None:
        """The expected gain as a JSON value of poses.json and metrics.json."""
        return self.expected and asdict(self.expected) | {"gain_per_photo": self.expected.each}


def read_state(given, start: int, taken: int, candidates: int) -> StoppingState:
    """Read the state from the inputs of a job: `fits`, and `last`, poses.json of the previous round if there is one."""
    stopped = read_pose_selection(given.last).stopped if given.get("last") else None
    return StoppingState(start, taken, [read_json(path) for path in given.fits], candidates, stopped)


def decide_poses(stop: dict, k: int, burst: int, state: StoppingState) -> Decision:
    """Decide how many poses to request next, or why none.

    stop: of the config: `photos`, the budget over all rounds, every photo of a burst counted; `marginal_gain`, least
    gain per photo in dB. k: poses of a round. A stop is final.
    """
    poses = k if "photos" not in stop else min(k, max(0, stop["photos"] - state.taken) // burst)
    coming = min(poses or k, state.candidates) * burst
    found = predict_gain(*build_history(state.fits, state.start), coming)
    if found is not None:
        _log.info("%s", describe_gain(found))
    elif "marginal_gain" in stop:
        _log.info("the gain of the next photos cannot be predicted yet: that takes three new photos")
    stopped = state.stopped or _budget_reason(stop, burst, state, poses) or _gain_reason(stop, state.taken, found)
    if stopped:
        _log.info("no further photo is requested: %s", stopped)
    return Decision(0 if stopped else poses, stopped, found)


def describe_gain(found: ExpectedGain) -> str:
    """An expected gain as text."""
    photos = "photo is" if found.photos == 1 else f"{found.photos} photos are"
    interval = f"{found.gain:.2f} dB ({found.low:.2f} to {found.high:.2f})"
    return f"the next {photos} expected to gain about {interval}, {found.each:.3f} dB a photo"


def _budget_reason(stop: dict, burst: int, state: StoppingState, poses: int) -> str | None:
    if not state.candidates:
        return f"after {state.taken} photos: no candidate pose is left"
    if poses:
        return None
    of = f"a pose takes {burst}, and " if burst > 1 else ""
    return f"after {state.taken} photos: {of}{stop['photos']} in all may be taken (stop.photos)"


def _gain_reason(stop: dict, taken: int, found: ExpectedGain | None) -> str | None:
    if "marginal_gain" not in stop or found is None or found.each >= stop["marginal_gain"]:
        return None
    return f"after {taken} photos: {describe_gain(found)}, less than {stop['marginal_gain']:g} (stop.marginal_gain)"
