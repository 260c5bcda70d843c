"""The table of policies: their names, what each reads, and how its settings stand in paths.

The functions are in `policies.py`. This module imports no numerics, so that the workflow can read it before any job.
"""

import re
from dataclasses import dataclass

AUTO = "auto"  # in the config: what `resolve_policy` says
POLICY_NAME = r"[a-z0-9-]+"  # what a policy's name is made of: it stands in paths between underscores


@dataclass(frozen=True)
class PolicySpec:
    """A policy: its name, which poses it chooses, and what it reads beside the places of the candidates.

    name: as in the config and in paths; small letters, digits and -. chooses: which poses, in words.
    reads_prior: scores by a prior.
    needs_field: the field itself. The policy gets an `InformationGain` (views/policies.py; directional coverage is one)
    as `SelectionInput.information`; for others that is None.
    needs_photos: the photos so far, for that object. needs_truth: true pictures of candidates, likewise (oracles).
    fixed_zero: of the prior's settings (p_drop, lam), those that have no effect and are 0 in paths.
    Raises: ValueError: another character in the name.
    """

    name: str
    chooses: str
    reads_prior: bool = False
    needs_field: bool = False
    needs_photos: bool = False
    needs_truth: bool = False
    fixed_zero: tuple[str, ...] = ()

    def __post_init__(self):
        if not re.fullmatch(POLICY_NAME, self.name):
            raise ValueError(f"policy {self.name!r}: a name has small letters, digits and - only")

    def describe_inputs(self) -> str:
        """What the policy reads, in words."""
        prior = "prior" + (f" (not {', '.join(f'`{key}`' for key in self.fixed_zero)})" if self.fixed_zero else "")
        reads = {
            prior: self.reads_prior,
            "field": self.needs_field,
            "photos": self.needs_photos,
            "true pictures": self.needs_truth,
        }
        return ", ".join(name for name, read in reads.items() if read) or "poses"


POLICY_SPECS = (
    PolicySpec("random", "k drawn at random"),
    PolicySpec("farthest", "greedily, the one farthest from all photos so far: farthest point sampling"),
    PolicySpec(
        "coverage",
        "greedily, the largest gain in directional coverage: every cell of the ground is to be seen large, and from "
        "many sides",
        needs_field=True,
    ),
    PolicySpec(
        "coverage-error",
        "as `coverage`, each cell weighted by the error of the field in the photos so far",
        needs_field=True,
        needs_photos=True,
    ),
    PolicySpec(
        "coverage-w2",
        "as `coverage`, each cell weighted by W2 between the prior's samples",
        reads_prior=True,
        needs_field=True,
        fixed_zero=("lam",),
    ),
    PolicySpec(
        "oracle",
        "as `coverage`, each cell weighted by the true error at the candidates: what a perfect score would choose",
        needs_field=True,
        needs_truth=True,
    ),
    PolicySpec("all", "all candidates, whatever `k` is"),
    PolicySpec(
        "grad-lpips",
        "the largest image gradient of the prior's mean sample plus `lam` LPIPS, each over its frozen scale (ablation)",
        reads_prior=True,
    ),
    PolicySpec(
        "w2-lpips", "the largest u = W2² + `lam` LPIPS, each over its frozen scale: the paper's top k", reads_prior=True
    ),
    PolicySpec(
        "w2", "the largest squared W2 of the prior's samples, in latents", reads_prior=True, fixed_zero=("lam",)
    ),
    PolicySpec(
        "single",
        "the largest LPIPS between one sample without dropout and the render (ablation)",
        reads_prior=True,
        fixed_zero=("p_drop", "lam"),
    ),
)

POLICY_NAMES = tuple(spec.name for spec in POLICY_SPECS)
PRIOR_POLICIES = tuple(spec.name for spec in POLICY_SPECS if spec.reads_prior)
ORACLES = tuple(spec.name for spec in POLICY_SPECS if spec.needs_truth)
NEEDS_PHOTOS = tuple(spec.name for spec in POLICY_SPECS if spec.needs_photos)
NEEDS_FIELD = tuple(spec.name for spec in POLICY_SPECS if spec.needs_field)
ZERO_SETTINGS = {spec.name: spec.fixed_zero for spec in POLICY_SPECS if spec.fixed_zero}


def resolve_policy(policy: str, agent: str | None) -> str:
    """The policy of a scene: the config's, `auto` by the scene's agent.

    Of given photos (`replay`) the best choice is to spread; where new ones are taken, to go back where the field is
    wrong. Measured: docs/active-views.md.
    """
    if policy != AUTO:
        return policy
    return "farthest" if agent == "replay" else "coverage-error"
