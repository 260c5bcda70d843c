"""Stopping rule of the rounds: a budget of photos, or a least expected gain.

All rounds are planned in advance. Rounds after the stop request no pose and pass the field on unchanged.
"""

import logging
from dataclasses import asdict, dataclass

from dav_gswt.files import read_json
from dav_gswt.views import marginal_gain
from dav_gswt.views.marginal_gain import ExpectedGain
from dav_gswt.views.selection import read_pose_selection

_log = logging.getLogger(__name__)


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
    found = marginal_gain.predict_gain(
        marginal_gain.build_history(state.fits, state.start, min(poses or k, state.candidates) * burst)
    )
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
