"""Policies: functions that choose which k of the scored candidates to capture next.

To add one: describe it in `policy_names.POLICY_SPECS`, write its function here, and decorate that with `@policy(name)`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.geometry.poses import select_farthest_poses
from dav_gswt.views.greedy import lazy_greedy
from dav_gswt.views.policy_names import POLICY_NAMES
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty.weighting import combine_image_terms, combine_terms


@runtime_checkable
class InformationGain(Protocol):
    """Information that photos give about a field; it grows with every choice."""

    def gains(self) -> list[float]:
        """Return the gain of every candidate."""
        ...

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
    """

    captured: Float[Array, "m 3"]
    k: int
    rng: np.random.Generator
    lam: float = 0.0
    information: InformationGain | None = None


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


@policy("farthest")
def farthest(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Farthest point sampling: the candidate farthest from all views so far; ties by index."""
    return select_farthest_poses(scores.poses, inputs.k, inputs.captured)


@policy("coverage")
@policy("coverage-error")
@policy("coverage-w2")
@policy("oracle")
def cover(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Greedy choice of the largest gain; every choice lowers the gain of the others."""
    if (information := inputs.information) is None:
        raise ValueError("a policy of coverage needs the information that photos give about the field")
    return lazy_greedy(information.gains(), information.gain, information.take, inputs.k)


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


@policy("w2-lpips")
def w2_lpips(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of greatest u = W2² + lam LPIPS, each over its frozen scale: the paper's Algorithm 1."""
    return top(uncertainty(scores, inputs.lam), inputs.k)


@policy("all")
def everything(scores: Scores, inputs: SelectionInput) -> list[int]:
    """All candidates, whatever k is."""
    return list(range(len(scores)))


def uncertainty(scores: Scores, lam: float) -> Float64[Array, "n"]:
    """Return u = W2² + lam LPIPS of every candidate."""
    return combine_terms(scores.term("w2_sq"), scores.terms.get("lpips"), lam, scores.scales, scores.names)


def top(values: Float[Array, "n"], k: int) -> list[int]:
    """The k largest; ties by index."""
    return [int(i) for i in np.argsort(-values, kind="stable")[:k]]
