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

    k: poses of a full round. chosen_with: the preset whose round it was, where this is a copy.
    """

    policy: str
    k: int
    poses: list[Pose]
    chosen_with: str | None = None


def select_poses(policy: str, scores: Scores, inputs: SelectionInput) -> list[Pose]:
    """Return the poses that a policy chooses: k, or for `all` all. Of fewer than k all are taken, with a warning."""
    if not len(scores):
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if inputs.k > len(scores):
        _log.warning("%d poses were asked for; all candidates that are left are taken: %d", inputs.k, len(scores))
        inputs = replace(inputs, k=len(scores))
    if policy == "all":
        inputs = replace(inputs, k=len(scores))
    return [scores.poses[i] for i in POLICIES[policy].choose(scores, inputs)[: inputs.k]]


def write_pose_selection(path: Path | str, selection: PoseSelection) -> None:
    """Write poses.json."""
    values = asdict(selection)
    write_json(path, {key: value for key, value in values.items() if key != "chosen_with" or value})


def read_pose_selection(path: Path | str) -> PoseSelection:
    """Read poses.json. Raises: InputError: not such a file."""
    return read_record(path, PoseSelection, "make it again")
