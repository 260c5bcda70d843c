"""Selection of the poses of a round, by a policy."""

import logging
from dataclasses import replace

from dav_gswt.geometry.poses import Pose
from dav_gswt.views.policies import POLICIES, SelectionInput
from dav_gswt.views.scores import Scores

_log = logging.getLogger(__name__)


def poses_per_round(policy: str, k: int, candidates: int) -> int:
    """Return k, or the number of candidates for the policy `all`, which takes them in one round."""
    return candidates if policy == "all" else k


def select(policy: str, scores: Scores, inputs: SelectionInput) -> list[Pose]:
    """Return the poses that a policy chooses, at most k. If k exceeds the pool, all are taken, with a warning."""
    if not len(scores):
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if inputs.k > len(scores):
        _log.warning("asked for %d poses; only %d candidates are left: all are taken", inputs.k, len(scores))
        inputs = replace(inputs, k=len(scores))
    return [scores.poses[i] for i in POLICIES[policy](scores, inputs)[: inputs.k]]
