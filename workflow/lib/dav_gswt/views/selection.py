"""Choosing the poses of a round: the policy's choice, and the cases in which there is little to choose."""

import logging
from dataclasses import replace

from dav_gswt.geometry.poses import Pose
from dav_gswt.views.policies import POLICIES, Wanted
from dav_gswt.views.scores import Scores

_log = logging.getLogger(__name__)


def asked(policy: str, k: int, left: int) -> int:
    """How many poses a round asks for by itself. left: candidates; the policy `all` takes them all at once."""
    return left if policy == "all" else k


def select(policy: str, scores: Scores, wanted: Wanted) -> list[Pose]:
    """The poses that a policy chooses, k at most. k greater than the pool takes all of it, and says so."""
    if not len(scores):
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if wanted.k > len(scores):
        _log.warning("asked for %d poses; only %d candidates are left: all are taken", wanted.k, len(scores))
        wanted = replace(wanted, k=len(scores))
    return [scores.poses[i] for i in POLICIES[policy](scores, wanted)[: wanted.k]]
