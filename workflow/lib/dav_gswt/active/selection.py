"""Policies: which k of the scored candidates to capture next. Each is a function of the scores and what is captured."""

import logging
from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.active.poses import Pose, Scored, place

_log = logging.getLogger(__name__)


def farthest(scored: list[Scored], captured: Float[Array, "m 3"], k: int, rng: np.random.Generator) -> list[int]:
    """Greedily the candidate farthest from all views taken or chosen so far (farthest points); ties by index."""
    places = np.array([place(s.pose) for s in scored]).reshape(-1, 3)
    nearest = np.full(len(places), np.inf)
    for view in captured:
        nearest = np.minimum(nearest, np.linalg.norm(places - view, axis=1))
    chosen: list[int] = []
    for _ in range(k):
        best = int(np.argmax(nearest))
        chosen.append(best)
        nearest = np.minimum(nearest, np.linalg.norm(places - places[best], axis=1))
        nearest[best] = -np.inf
    return chosen


def opacity(scored: list[Scored], captured: Float[Array, "m 3"], k: int, rng: np.random.Generator) -> list[int]:
    """The k candidates whose pictures hold most that is not known to be opaque; ties by index."""
    return [int(i) for i in np.argsort([-s.opacity for s in scored], kind="stable")[:k]]


def random(scored: list[Scored], captured: Float[Array, "m 3"], k: int, rng: np.random.Generator) -> list[int]:
    """k candidates drawn without replacement."""
    return [int(i) for i in rng.permutation(len(scored))[:k]]


POLICIES: dict[str, Callable[..., list[int]]] = {"farthest": farthest, "opacity": opacity, "random": random}


def select(
    policy: str, scored: list[Scored], captured: Float[Array, "m 3"], k: int, rng: np.random.Generator
) -> list[Pose]:
    """The poses that a policy chooses. k greater than the pool takes all of it, and says so."""
    if not scored:
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if k > len(scored):
        _log.warning("asked for %d poses; only %d candidates are left: all are taken", k, len(scored))
        k = len(scored)
    return [scored[i].pose for i in POLICIES[policy](scored, captured, k, rng)]
