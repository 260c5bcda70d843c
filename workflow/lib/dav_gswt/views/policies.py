"""Policies: functions that choose which k of the scored candidates to capture next.

To add one: describe it in `policy_names.POLICY_SPECS`, write its function here, and decorate that with `@policy(name)`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.geometry.poses import Pose, pose_offset, select_farthest_poses
from dav_gswt.views import facility_location
from dav_gswt.views.greedy import lazy_greedy
from dav_gswt.views.policy_names import POLICY_NAMES
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty.weighting import combine_image_terms, combine_terms

RING = 45.0  # elevation of a ring, degrees
TURN = 180 * (3 - 5**0.5)  # degrees between the starts of rings: the golden angle avoids coincidences


@runtime_checkable
class InformationGain(Protocol):
    """Information that photos give about a field; it grows with every choice."""

    def gain(self, i: int) -> float:
        """Return what a photo from candidate i adds to the photos taken or chosen so far."""
        ...

    def take(self, i: int) -> None:
        """Add the photo from candidate i."""
        ...


@dataclass(frozen=True)
class SelectionInput:
    """What a policy reads beside the scores.

    captured: camera centres of the photos so far, relative to the exemplar's middle. k: number of poses to choose, at
    most the number of candidates. lam: weight of LPIPS. information: for policies with `needs_field`, else None.
    errors: true error of each candidate, NaN where unknown, for policies with `needs_truth`, else None.
    """

    captured: Float[Array, "m 3"]
    k: int
    rng: np.random.Generator
    lam: float = 0.0
    information: InformationGain | None = None
    errors: Float64[Array, "n"] | None = None


Policy = Callable[[Scores, SelectionInput], list[int]]
POLICIES: dict[str, Policy] = {}


def policy(name: str) -> Callable[[Policy], Policy]:
    """Register a function as the policy `name`. It returns indices of candidates, best first."""
    if name not in POLICY_NAMES:
        raise ValueError(f"{name}: describe the policy in policy_names.POLICY_SPECS first")

    def register(function: Policy) -> Policy:
        POLICIES[name] = function
        return function

    return register


@policy("random")
def random(scores: Scores, inputs: SelectionInput) -> list[int]:
    """k candidates drawn without replacement."""
    return [int(i) for i in inputs.rng.permutation(len(scores))[: inputs.k]]


@policy("ring")
def ring(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The candidates nearest to k evenly spaced points on a ring; the ring turns from round to round."""
    places, chosen = _places(scores.poses), []
    radius = float(np.median(np.linalg.norm(places, axis=1)))
    for i in range(inputs.k):
        at = pose_offset(Pose("", RING, (len(inputs.captured) * TURN + 360 * i / inputs.k) % 360, radius))
        apart = np.linalg.norm(places - at, axis=1)
        apart[chosen] = np.inf
        chosen.append(int(np.argmin(apart)))
    return chosen


@policy("farthest")
def farthest(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Farthest point sampling: the candidate farthest from all views so far; ties by index."""
    return select_farthest_poses(scores.poses, inputs.k, inputs.captured)


@policy("diverse")
def diverse(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Facility location with equal weights: coverage alone."""
    return facility_location.select_facilities(_places(scores.poses), inputs.captured, np.ones(len(scores)), inputs.k)


@policy("opacity")
def opacity(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of highest mean rendered uncertainty."""
    return top(scores.term("opacity"), inputs.k)


@policy("fisher")
def fisher(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Greedy choice of the largest information gain; every choice lowers the gain of the others."""
    if inputs.information is None:
        raise ValueError("fisher: needs the information that photos give about the field")
    return lazy_greedy(scores.term("fisher"), inputs.information.gain, inputs.information.take, inputs.k)


@policy("grad-lpips")
def grad_lpips(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of greatest u_img, an ablation: texture of the expected picture, and lam LPIPS."""
    gradient, lpips = scores.term("gradient"), scores.terms.get("lpips")
    return top(combine_image_terms(gradient, lpips, inputs.lam, scores.scales, scores.names), inputs.k)


@policy("w2")
def w2(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates whose samples disagree most in latents."""
    return top(scores.term("w2_sq"), inputs.k)


@policy("single")
def single(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates whose single sample, without dropout, differs most from the render."""
    return top(scores.term("single"), inputs.k)


@policy("residual")
def residual(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates whose expected picture differs most from the render, in latents."""
    return top(scores.term("residual"), inputs.k)


@policy("residual-diverse")
def residual_diverse(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Facility location weighted by `residual`."""
    return facility_location.select_facilities(
        _places(scores.poses), inputs.captured, scores.term("residual"), inputs.k
    )


@policy("w2-lpips")
def w2_lpips(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of greatest u = W2 + lam LPIPS, each over its frozen scale: the paper's Algorithm 1."""
    return top(uncertainty(scores, inputs.lam), inputs.k)


@policy("w2-lpips-diverse")
def w2_lpips_diverse(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Facility location weighted by u: uncertain candidates get a photo nearby."""
    return facility_location.select_facilities(
        _places(scores.poses), inputs.captured, uncertainty(scores, inputs.lam), inputs.k
    )


@policy("shuffled")
def shuffled(scores: Scores, inputs: SelectionInput) -> list[int]:
    """As `w2_lpips_diverse`, with u permuted among the candidates: a control of u against diversity."""
    permuted = inputs.rng.permutation(uncertainty(scores, inputs.lam))
    return facility_location.select_facilities(_places(scores.poses), inputs.captured, permuted, inputs.k)


@policy("oracle")
def oracle(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of greatest true error, among those whose truth is known: the choice of a perfect score."""
    errors = _true_errors(inputs)
    return top(np.where(np.isnan(errors), -np.inf, errors), inputs.k)


@policy("oracle-diverse")
def oracle_diverse(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Facility location weighted by the true error, 0 where it is unknown."""
    return facility_location.select_facilities(
        _places(scores.poses), inputs.captured, np.nan_to_num(_true_errors(inputs)), inputs.k
    )


@policy("all")
def everything(scores: Scores, inputs: SelectionInput) -> list[int]:
    """All candidates, whatever k is."""
    return list(range(len(scores)))


def uncertainty(scores: Scores, lam: float) -> Float64[Array, "n"]:
    """Return u = W2 + lam LPIPS of every candidate."""
    return combine_terms(scores.term("w2_sq"), scores.terms.get("lpips"), lam, scores.scales, scores.names)


def top(values: Float[Array, "n"], k: int) -> list[int]:
    """The k largest; ties by index."""
    return [int(i) for i in np.argsort(-values, kind="stable")[:k]]


def _true_errors(inputs: SelectionInput) -> Float64[Array, "n"]:
    if inputs.errors is None:
        raise ValueError("an oracle needs the true errors of the candidates")
    return inputs.errors


def _places(poses: list[Pose]) -> Float64[Array, "n 3"]:
    return np.array([pose_offset(pose) for pose in poses], float).reshape(-1, 3)
