"""The table of policies: their names, what each reads, and how its results are spelled in paths.

The functions are in `policies.py`. This module imports no numerics, so that the workflow can read it before any job.
"""

from dataclasses import dataclass

EXTERNAL = "external"  # stands in paths in place of a policy: a finished field, refined by no photo


@dataclass(frozen=True)
class PolicySpec:
    """What a policy reads beside the geometric scores.

    reads_prior: terms of a prior. needs_truth: the true error at the candidates (oracles). needs_field: the field
    itself, not only its scores. fixed_zero: of the prior's settings (p_drop, lam), those that have no effect and are 0
    in paths. chooses: which poses, in words.
    """

    name: str
    chooses: str
    reads_prior: bool = False
    needs_truth: bool = False
    needs_field: bool = False
    fixed_zero: tuple[str, ...] = ()

    def describe_inputs(self) -> str:
        """What the policy reads, in words."""
        if self.reads_prior:
            return "a prior" + (f"; without {', '.join(self.fixed_zero)}" if self.fixed_zero else "")
        return "the true error" if self.needs_truth else "the field" if self.needs_field else "poses"


POLICY_SPECS = (
    PolicySpec("random", "any"),
    PolicySpec("ring", "the nearest to places evenly on a ring at 45 degrees, turned each round"),
    PolicySpec("farthest", "greedily the farthest from every view so far"),
    PolicySpec("diverse", "what covers the pool best: facility location with equal weights"),
    PolicySpec("opacity", "those that see most of what is not known to be opaque"),
    PolicySpec("fisher", "the most information on the Gaussians' colours, greedily", needs_field=True),
    PolicySpec("oracle", "the greatest true error: what a perfect score would choose", needs_truth=True),
    PolicySpec("oracle-diverse", "facility location, weighted by the true error", needs_truth=True),
    PolicySpec("all", "the whole pool, whatever `k` is"),
    PolicySpec("grad-lpips", "texture of what the prior expects, plus `lam` LPIPS (ablation)", reads_prior=True),
    PolicySpec("w2-lpips", "the greatest u = W2 + `lam` LPIPS over frozen scales: the paper's top k", reads_prior=True),
    PolicySpec("w2-lpips-diverse", "facility location, weighted by u", reads_prior=True),
    PolicySpec("shuffled", "as `w2-lpips-diverse`, with u permuted (ablation)", reads_prior=True),
    PolicySpec("w2", "where samples lie farthest apart in latents", reads_prior=True, fixed_zero=("lam",)),
    PolicySpec(
        "single",
        "where one sample looks least like the render (ablation)",
        reads_prior=True,
        fixed_zero=("p_drop", "lam"),
    ),
    PolicySpec(
        "residual",
        "where the mean sample lies farthest from the render, in latents",
        reads_prior=True,
        fixed_zero=("lam",),
    ),
    PolicySpec(
        "residual-diverse", "facility location, weighted by that residual", reads_prior=True, fixed_zero=("lam",)
    ),
)

POLICY_NAMES = tuple(spec.name for spec in POLICY_SPECS)
GEOMETRIC = tuple(spec.name for spec in POLICY_SPECS if not spec.reads_prior)
PRIOR_POLICIES = tuple(spec.name for spec in POLICY_SPECS if spec.reads_prior)
ORACLES = tuple(spec.name for spec in POLICY_SPECS if spec.needs_truth)
NEEDS_FIELD = tuple(spec.name for spec in POLICY_SPECS if spec.needs_field)
ZERO_SETTINGS = {spec.name: spec.fixed_zero for spec in POLICY_SPECS if spec.fixed_zero}
