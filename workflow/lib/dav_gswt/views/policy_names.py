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
    in paths.
    """

    name: str
    reads_prior: bool = False
    needs_truth: bool = False
    needs_field: bool = False
    fixed_zero: tuple[str, ...] = ()


POLICY_SPECS = (
    PolicySpec("random"),
    PolicySpec("ring"),
    PolicySpec("farthest"),
    PolicySpec("diverse"),
    PolicySpec("opacity"),
    PolicySpec("fisher", needs_field=True),
    PolicySpec("oracle", needs_truth=True),
    PolicySpec("oracle-diverse", needs_truth=True),
    PolicySpec("all"),
    PolicySpec("grad-lpips", reads_prior=True),
    PolicySpec("w2-lpips", reads_prior=True),
    PolicySpec("w2-lpips-diverse", reads_prior=True),
    PolicySpec("shuffled", reads_prior=True),
    PolicySpec("w2", reads_prior=True, fixed_zero=("lam",)),
    PolicySpec("single", reads_prior=True, fixed_zero=("p_drop", "lam")),
    PolicySpec("residual", reads_prior=True, fixed_zero=("lam",)),
    PolicySpec("residual-diverse", reads_prior=True, fixed_zero=("lam",)),
)

POLICY_NAMES = tuple(spec.name for spec in POLICY_SPECS)
GEOMETRIC = tuple(spec.name for spec in POLICY_SPECS if not spec.reads_prior)
PRIOR_POLICIES = tuple(spec.name for spec in POLICY_SPECS if spec.reads_prior)
ORACLES = tuple(spec.name for spec in POLICY_SPECS if spec.needs_truth)
NEEDS_FIELD = tuple(spec.name for spec in POLICY_SPECS if spec.needs_field)
ZERO_SETTINGS = {spec.name: spec.fixed_zero for spec in POLICY_SPECS if spec.fixed_zero}
