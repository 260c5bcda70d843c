"""Policies: which k of the scored candidates to capture next. Each is a function of the scores and what is wanted."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.geometry.poses import Pose, place, spread
from dav_gswt.views import facility_location
from dav_gswt.views.greedy import lazily
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty.weighting import combined, combined_image

RING = 45.0  # degrees of elevation that a ring keeps to
TURN = 180 * (3 - 5**0.5)  # degrees between the starts of rings: the golden angle, so that none falls on another


@runtime_checkable
class Information(Protocol):
    """What photos tell about a field, as it grows with every choice."""

    def gain(self, i: int) -> float:
        """Of a photo from candidate i, given all that was taken."""

    def take(self, i: int) -> None:
        """Candidate i is chosen."""


@dataclass(frozen=True)
class Wanted:
    """What a policy goes by beside the scores. captured: where photos were taken, relative to the exemplar's middle.
    k: poses to choose, at most as many as there are. lam: weight of LPIPS. information: for `fisher`. errors: true ones
    of the candidates, NaN where not known, for oracles."""

    captured: Float[Array, "m 3"]
    k: int
    rng: np.random.Generator
    lam: float = 0.0
    information: Information | None = None
    errors: Float64[Array, "n"] | None = None


def random(scores: Scores, wanted: Wanted) -> list[int]:
    """k candidates drawn without replacement."""
    return [int(i) for i in wanted.rng.permutation(len(scores))[: wanted.k]]


def ring(scores: Scores, wanted: Wanted) -> list[int]:
    """The candidates nearest to k places evenly on a ring, each taken once; every round's ring is turned."""
    places, chosen = _places(scores.poses), []
    radius = float(np.median(np.linalg.norm(places, axis=1)))
    for i in range(wanted.k):
        at = place(Pose("", RING, (len(wanted.captured) * TURN + 360 * i / wanted.k) % 360, radius))
        apart = np.linalg.norm(places - at, axis=1)
        apart[chosen] = np.inf
        chosen.append(int(np.argmin(apart)))
    return chosen


def farthest(scores: Scores, wanted: Wanted) -> list[int]:
    """Greedily the candidate farthest from all views taken or chosen so far (farthest points); ties by index."""
    return spread(scores.poses, wanted.k, wanted.captured)


def diverse(scores: Scores, wanted: Wanted) -> list[int]:
    """Facility location with all candidates alike: coverage alone."""
    return facility_location.located(_places(scores.poses), wanted.captured, np.ones(len(scores)), wanted.k)


def opacity(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates whose pictures hold most that is not known to be opaque."""
    return top(scores.term("opacity"), wanted.k)


def fisher(scores: Scores, wanted: Wanted) -> list[int]:
    """Greedily the candidate of the largest gain of information, which every choice lowers for the others."""
    at = wanted.information
    return lazily(scores.term("fisher"), at.gain, at.take, wanted.k)


def grad_lpips(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates of greatest u_img, an ablation: texture of what the prior expects, and lam LPIPS."""
    gradient, lpips = scores.term("gradient"), scores.terms.get("lpips")
    return top(combined_image(gradient, lpips, wanted.lam, scores.scales, scores.names), wanted.k)


def w2(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates whose samples lie farthest apart in latents."""
    return top(scores.term("w2_sq"), wanted.k)


def single(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates whose one sample looks least like the render: a single forward pass, without dropout."""
    return top(scores.term("single"), wanted.k)


def residual(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates whose picture the prior expects to differ most from the render."""
    return top(scores.term("residual"), wanted.k)


def residual_diverse(scores: Scores, wanted: Wanted) -> list[int]:
    """Facility location weighed by the same: where the render looks wrong a photo is to be near."""
    return facility_location.located(_places(scores.poses), wanted.captured, scores.term("residual"), wanted.k)


def w2_lpips(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates of greatest u = W2 + lam LPIPS, each over its frozen scale: the paper's Algorithm 1."""
    return top(doubt(scores, wanted.lam), wanted.k)


def w2_lpips_diverse(scores: Scores, wanted: Wanted) -> list[int]:
    """Facility location weighed by u: doubtful candidates are to have a photo near."""
    return facility_location.located(_places(scores.poses), wanted.captured, doubt(scores, wanted.lam), wanted.k)


def shuffled(scores: Scores, wanted: Wanted) -> list[int]:
    """As `w2_lpips_diverse`, with u dealt out anew among the candidates: is it the doubt, or the diversity?"""
    dealt = wanted.rng.permutation(doubt(scores, wanted.lam))
    return facility_location.located(_places(scores.poses), wanted.captured, dealt, wanted.k)


def oracle(scores: Scores, wanted: Wanted) -> list[int]:
    """The k candidates of greatest true error, of those whose truth is known: what a perfect score would choose."""
    return top(np.where(np.isnan(wanted.errors), -np.inf, wanted.errors), wanted.k)


def oracle_diverse(scores: Scores, wanted: Wanted) -> list[int]:
    """Facility location weighed by the true error, 0 where it is not known: a perfect score and diversity."""
    return facility_location.located(_places(scores.poses), wanted.captured, np.nan_to_num(wanted.errors), wanted.k)


def everything(scores: Scores, wanted: Wanted) -> list[int]:
    """The whole pool, whatever k is."""
    return list(range(len(scores)))


def doubt(scores: Scores, lam: float) -> Float64[Array, "n"]:
    """u = W2 + lam LPIPS of every candidate."""
    return combined(scores.term("w2_sq"), scores.terms.get("lpips"), lam, scores.scales, scores.names)


def top(values: Float[Array, "n"], k: int) -> list[int]:
    """The k largest; ties by index."""
    return [int(i) for i in np.argsort(-values, kind="stable")[:k]]


def _places(found: list[Pose]) -> Float64[Array, "n 3"]:
    return np.array([place(pose) for pose in found], float).reshape(-1, 3)


POLICIES: dict[str, Callable[[Scores, Wanted], list[int]]] = {
    "random": random,
    "ring": ring,
    "farthest": farthest,
    "diverse": diverse,
    "opacity": opacity,
    "fisher": fisher,
    "grad-lpips": grad_lpips,
    "w2": w2,
    "single": single,
    "residual": residual,
    "residual-diverse": residual_diverse,
    "w2-lpips": w2_lpips,
    "w2-lpips-diverse": w2_lpips_diverse,
    "shuffled": shuffled,
    "oracle": oracle,
    "oracle-diverse": oracle_diverse,
    "all": everything,
}
