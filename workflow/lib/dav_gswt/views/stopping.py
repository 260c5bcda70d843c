"""When to stop asking for views: at a number of photos, or where the next ones are expected to gain too little.

All rounds are planned beforehand. One after the stop asks for no pose, and hands the field on as it is.
"""

import logging
from dataclasses import asdict, dataclass

from dav_gswt.files import read_json
from dav_gswt.views import marginal_gain
from dav_gswt.views.marginal_gain import ExpectedGain

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StoppingState:
    """What a decision rests on. start, taken: photos before the first round, and so far in all. fits: fit.json of the
    rounds so far. left: candidate poses. last: poses.json of the round before, None before the first."""

    start: int
    taken: int
    fits: list[dict]
    left: int
    last: dict | None = None


@dataclass(frozen=True)
class Decision:
    """poses: how many to ask for. stopped: why none, else None. expected: what these poses, or the ones that are not
    asked for any more, would gain; None where it cannot be said."""

    poses: int
    stopped: str | None
    expected: ExpectedGain | None

    def to_json(self) -> dict:
        """What poses.json and metrics.json say of it."""
        gain = self.expected and asdict(self.expected) | {"gain_per_photo": self.expected.each}
        return {"stopped": self.stopped, "expected": gain}


def read_state(given, start: int, taken: int, left: int) -> StoppingState:
    """Out of the files of a job. given: its inputs `fits` and, where there is a round before, `last`."""
    last = read_json(given.last) if given.get("last") else None
    return StoppingState(start, taken, [read_json(path) for path in given.fits], left, last)


def decide(stop: dict, k: int, burst: int, known: StoppingState) -> Decision:
    """How many poses to ask for next, or why none.

    stop: as the config has it: `photos`, which all rounds together never exceed, every photo of a burst counted;
    `worth`, dB that each photo is to gain. k: poses that a round asks for. Once stopped, it stays so.
    """
    poses = k if "photos" not in stop else min(k, max(0, stop["photos"] - known.taken) // burst)
    found = marginal_gain.predict_gain(
        marginal_gain.build_history(known.fits, known.start, min(poses or k, known.left) * burst)
    )
    if found is not None:
        _log.info("%s", describe_gain(found))
    elif "marginal_gain" in stop:
        _log.info("what the next photos are worth cannot be said yet: that takes three new photos")
    stopped = known.last["stopped"] if known.last else None
    stopped = stopped or _budget_reason(stop, burst, known, poses) or _gain_reason(stop, known.taken, found)
    if stopped:
        _log.info("no further photo is asked for: %s", stopped)
    return Decision(0 if stopped else poses, stopped, found)


def decision_record(chosen: dict) -> dict:
    """What poses.json says of the decision, for the metrics of its round."""
    return {key: chosen[key] for key in ("stopped", "expected")}


def describe_gain(found: ExpectedGain) -> str:
    """An expected gain for people."""
    many = "the next photo is" if found.photos == 1 else f"the next {found.photos} photos are"
    return f"{many} worth about {found.gain:.2f} dB ({found.low:.2f} to {found.high:.2f}), {found.each:.3f} a photo"


def _budget_reason(stop: dict, burst: int, known: StoppingState, poses: int) -> str | None:
    if not known.left:
        return f"after {known.taken} photos: no candidate pose is left"
    if poses:
        return None
    of = f"a pose takes {burst}, and " if burst > 1 else ""
    return f"after {known.taken} photos: {of}{stop['photos']} in all may be taken (stop.photos)"


def _gain_reason(stop: dict, taken: int, found: ExpectedGain | None) -> str | None:
    if "marginal_gain" not in stop or found is None or found.each >= stop["marginal_gain"]:
        return None
    return f"after {taken} photos: {describe_gain(found)}, less than {stop['marginal_gain']:g} (stop.marginal_gain)"
