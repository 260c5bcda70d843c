"""Policies: which k of the scored candidates to capture next. Each is a function of the scores and what is captured."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.active.poses import Pose, place
from dav_gswt.active.scores import Scores
from dav_gswt.active.uncertainty.weighing import combined

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Wanted:
    """What a policy goes by beside the scores. captured: where photos were taken, relative to the exemplar's middle.
    k: poses to choose, at most as many as there are. lam: weight of LPIPS."""

    captured: Float[Array, "m 3"]
    k: int
    rng: np.random.Generator
    lam: float = 0.0


def farthest(scores: Scores, wanted: Wanted) -> list[int]:
    """Greedily the candidate farthest from all views taken or chosen so far (farthest points); ties by index."""
    places = np.array([place(pose) for pose in scores.poses]).reshape(-1, 3)
    nearest = np.full(len(places), np.inf)
    for view in wanted.captured:
        nearest = np.minimum(nearest, np.linalg.norm(places - view, axis=1))
    chosen: list[int] = []
    for _ in range(wanted.k):
        best = int(np.argmax(nearest))
        chosen.append(best)
        nearest = np.minimum(nearest, np.linalg.norm(places - places[best], axis=1))
        nearest[best] = -np.inf
    return chosen


def opacity(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates whose pictures hold most that is not known to be opaque."""
    return top(scores.term("opacity"), wanted.k)


def w2_lpips(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates of greatest u = W2 + lam LPIPS, each over its frozen scale: the paper's Algorithm 1."""
    w2_sq, lpips = scores.term("w2_sq"), scores.terms.get("lpips")
    return top(combined(w2_sq, lpips, wanted.lam, scores.scales, scores.names), wanted.k)


def random(scores: Scores, wanted: Wanted) -> list[int]:
    """k candidates drawn without replacement."""
    return [int(i) for i in wanted.rng.permutation(len(scores))[: wanted.k]]


def top(values: Float[Array, "n"], k: int) -> list[int]:
    """The k largest; ties by index."""
    return [int(i) for i in np.argsort(-values, kind="stable")[:k]]


POLICIES: dict[str, Callable[[Scores, Wanted], list[int]]] = {
    "farthest": farthest,
    "opacity": opacity,
    "random": random,
    "w2-lpips": w2_lpips,
}


def select(policy: str, scores: Scores, wanted: Wanted) -> list[Pose]:
    """The poses that a policy chooses. k greater than the pool takes all of it, and says so."""
    if not len(scores):
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if wanted.k > len(scores):
        _log.warning("asked for %d poses; only %d candidates are left: all are taken", wanted.k, len(scores))
        wanted = replace(wanted, k=len(scores))
    return [scores.poses[i] for i in POLICIES[policy](scores, wanted)]
