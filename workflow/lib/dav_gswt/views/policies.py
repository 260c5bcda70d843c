"""Policies: functions that choose which k of the scored candidates to capture next.

To add one, write its function here and decorate it with `@policy(name, ...)`: names, rules and docs follow from the
decorator. The workflow reads this module before any job, so it imports nothing slow.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.geometry.poses import select_farthest_poses
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty import combine_terms, divide_by_scale

if TYPE_CHECKING:
    from dav_gswt.views.coverage import DirectionalCoverage

AUTO = "auto"  # in the config: what `resolve_policy` says
HIGHEST = 0.98  # quantile of all candidates' values at which colours of figures end
POLICY_NAME = r"[a-z0-9-]+"  # what a policy's name is made of: it stands in paths between underscores


@dataclass(frozen=True)
class SelectionInput:
    """What a policy reads beside the scores.

    captured: camera centres of the photos so far, relative to the exemplar's middle. k: number of poses to choose, at
    most the number of candidates. lam: weight of LPIPS. information: for policies that need the field, else None.
    """

    captured: Float[Array, "m 3"]
    k: int
    rng: np.random.Generator
    lam: float = 0.0
    information: "DirectionalCoverage | None" = None


@dataclass(frozen=True)
class Policy:
    """A policy: a function that returns indices of candidates, best first, and what the workflow must know of it.

    name: as in the config and in paths; small letters, digits and -. chooses: which poses, in words. needs: what it
    reads beside the places of the candidates: `prior` (scores by a prior), `field` (it gets a `DirectionalCoverage`),
    and for that object `photos` (the photos so far). fixed_zero: of the prior's settings (p_drop, lam), those that have
    no effect and are 0 in paths.
    Raises: ValueError: another character in the name.
    """

    name: str
    chooses: str
    choose: Callable[[Scores, SelectionInput], list[int]]
    needs: tuple[str, ...] = ()
    fixed_zero: tuple[str, ...] = ()

    def __post_init__(self):
        if not re.fullmatch(POLICY_NAME, self.name):
            raise ValueError(f"policy {self.name!r}: a name has small letters, digits and - only")

    def describe_inputs(self) -> str:
        """What the policy reads, in words."""
        unread = f" (not {', '.join(f'`{key}`' for key in self.fixed_zero)})" if self.fixed_zero else ""
        return ", ".join(f"prior{unread}" if need == "prior" else need for need in self.needs) or "poses"


POLICIES: dict[str, Policy] = {}


def policy(name: str, chooses: str, needs: tuple[str, ...] = (), fixed_zero: tuple[str, ...] = ()) -> Callable:
    """Register a function as a policy; see `Policy`."""

    def register(function: Callable[[Scores, SelectionInput], list[int]]) -> Callable:
        POLICIES[name] = Policy(name, chooses, function, needs, fixed_zero)
        return function

    return register


@policy("random", "k candidates drawn at random")
def random(scores: Scores, inputs: SelectionInput) -> list[int]:
    """k candidates drawn without replacement."""
    return [int(i) for i in inputs.rng.permutation(len(scores))[: inputs.k]]


@policy(
    "farthest", "one by one, the candidate that is farthest from the nearest photo so far (farthest point sampling)"
)
def farthest(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Farthest point sampling: the candidate farthest from all views so far; ties by index."""
    return select_farthest_poses(scores.poses, inputs.k, inputs.captured)


@policy(
    "coverage-w2",
    "like `coverage`, but a cell counts more if the prior's samples differ more there (in W2)",
    needs=("prior", "field"),
    fixed_zero=("lam",),
)
@policy(
    "coverage-error",
    "like `coverage`, but a cell counts more if renders of the field differ more from the photos there",
    needs=("field", "photos"),
)
@policy(
    "coverage",
    "one by one, the candidate that adds most to directional coverage. Coverage is high if photos show every cell of "
    "the ground at a high resolution and from many sides",
    needs=("field",),
)
def cover(scores: Scores, inputs: SelectionInput) -> list[int]:
    """Greedy choice of the largest gain; every choice lowers the gain of the others. Ties by index."""
    if (information := inputs.information) is None:
        raise ValueError("a policy of coverage needs the information that photos give about the field")
    chosen: list[int] = []
    for _ in range(min(inputs.k, len(scores))):
        gains = np.array(information.gains(), float)
        gains[chosen] = -np.inf
        chosen.append(int(gains.argmax()))
        information.take(chosen[-1])
    return chosen


@policy("all", "all candidates, whatever `k` is")
def everything(scores: Scores, inputs: SelectionInput) -> list[int]:
    """All candidates, whatever k is."""
    return list(range(len(scores)))


@policy(
    "grad-lpips",
    "the k candidates with the largest `gradient` + `lam` · `lpips` (an ablation)",
    needs=("prior",),
)
def grad_lpips(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of greatest u_img, an ablation: texture of the expected picture, and lam LPIPS."""
    return top(uncertainty(scores, inputs.lam, "gradient"), inputs.k)


@policy(
    "w2-lpips",
    "the k candidates with the largest uncertainty u = `w2_sq` + `lam` · `lpips`, as in the paper",
    needs=("prior",),
)
def w2_lpips(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates of greatest u = W2² + lam LPIPS, each over its frozen scale: the paper's Algorithm 1."""
    return top(uncertainty(scores, inputs.lam), inputs.k)


@policy("w2", "the k candidates with the largest `w2_sq`", needs=("prior",), fixed_zero=("lam",))
def w2(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates whose samples disagree most in latents."""
    return top(scores.term("w2_sq"), inputs.k)


@policy(
    "single",
    "the k candidates with the largest `single`: LPIPS between one sample without dropout and the render (an ablation)",
    needs=("prior",),
    fixed_zero=("p_drop", "lam"),
)
def single(scores: Scores, inputs: SelectionInput) -> list[int]:
    """The k candidates whose single sample, without dropout, differs most from the render."""
    return top(scores.term("single"), inputs.k)


POLICY_NAMES = tuple(POLICIES)
PRIOR_POLICIES, NEEDS_FIELD, NEEDS_PHOTOS = (
    tuple(name for name, each in POLICIES.items() if need in each.needs) for need in ("prior", "field", "photos")
)
ZERO_SETTINGS = {name: each.fixed_zero for name, each in POLICIES.items() if each.fixed_zero}


def resolve_policy(policy: str, agent: str | None) -> str:
    """The policy of a scene: the config's, `auto` by the scene's agent.

    Of given photos (`replay`) the best choice is to spread; where new ones are taken, to go back where the field is
    wrong. Measured: docs/active-views.md.
    """
    if policy != AUTO:
        return policy
    return "farthest" if agent == "replay" else "coverage-error"


def uncertainty(scores: Scores, lam: float, term: str = "w2_sq") -> Float64[Array, "n"]:
    """Return u = W2² + lam LPIPS of every candidate, or another term in place of W2²."""
    lpips = scores.terms.get("lpips")
    return combine_terms(scores.term(term), lpips, lam, scores.scales, term)


def candidate_values(scores: Scores, lam: float) -> tuple[str, Float64[Array, "n"]]:
    """Label and values by which figures colour candidates.

    The values are the uncertainty u, or without a prior or without dropout, where all samples agree, the gain in
    coverage.
    """
    if scores.scales.by_term.get("w2_sq", 0.0) > 0:
        lpips = f" + {lam:g} LPIPS" if lam and "lpips" in scores.terms else ""
        return f"uncertainty u = W2{lpips}, in units of the scale frozen at round 1", uncertainty(scores, lam)
    values = divide_by_scale("coverage", scores.term("coverage"), scores.scales)
    return "gain in coverage of the ground, in units of the scale frozen at round 1", values


def top(values: Float[Array, "n"], k: int) -> list[int]:
    """The k largest; ties by index."""
    return [int(i) for i in np.argsort(-values, kind="stable")[:k]]
