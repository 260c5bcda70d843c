"""Selection of the poses of a round by a policy, and poses.json, its record."""

import logging
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from dav_gswt.files import read_record, write_json
from dav_gswt.geometry.poses import Pose
from dav_gswt.views.policies import POLICIES, SelectionInput
from dav_gswt.views.scores import Scores

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PoseSelection:
    """The poses that a round requests, in the order of choice.

    k: poses of a full round. stopped: reason why no pose is requested, else None. expected: predicted gain as a JSON
    value, see `stopping.Decision.expected_gain`. chosen_with: the preset whose round it was, where this is a copy.
    """

    policy: str
    k: int
    poses: list[Pose]
    stopped: str | None = None
    expected: dict | None = None
    chosen_with: str | None = None

    def describe_outcome(self) -> dict:
        """Why no pose is requested and the predicted gain, as metrics.json holds them."""
        return {"stopped": self.stopped, "expected": self.expected}


def poses_per_round(policy: str, k: int, candidates: int) -> int:
    """Return k, or the number of candidates for the policy `all`, which takes them in one round."""
    return candidates if policy == "all" else k


def select_poses(policy: str, scores: Scores, inputs: SelectionInput) -> list[Pose]:
    """Return the poses that a policy chooses, at most k. Of fewer candidates all are taken, with a warning."""
    if not len(scores):
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if inputs.k > len(scores):
        _log.warning("%d poses were asked for; all candidates that are left are taken: %d", inputs.k, len(scores))
        inputs = replace(inputs, k=len(scores))
    return [scores.poses[i] for i in POLICIES[policy].choose(scores, inputs)[: inputs.k]]


def write_pose_selection(path: Path | str, selection: PoseSelection) -> None:
    """Write poses.json."""
    values = asdict(selection)
    write_json(path, {key: value for key, value in values.items() if key != "chosen_with" or value})


def read_pose_selection(path: Path | str) -> PoseSelection:
    """Read poses.json. Raises: InputError: not such a file."""
    return read_record(path, PoseSelection, "make it again")
