"""Names of the policies, apart from their code: the workflow reads them without loading the numerics."""

ORACLES = ("oracle", "oracle-diverse")  # that see the truth: what a perfect score would be worth
GEOMETRIC = ("random", "ring", "farthest", "diverse", "opacity", "fisher", *ORACLES, "all")  # read no prior
IMAGINING = ("grad-lpips", "w2-lpips", "w2-lpips-diverse", "shuffled", "w2", "single", "residual", "residual-diverse")
AT_ZERO = {  # what these of them do without
    "w2": ("lam",),
    "single": ("p_drop", "lam"),
    "residual": ("lam",),
    "residual-diverse": ("lam",),
}
POLICIES = (*GEOMETRIC, *IMAGINING, "given")  # given: a finished field, no round of views

# Agents that are devices or people, and the module that speaks to each.
DEVICES = {"serial": "rig", "plan": "mission", "handheld": "walk"}
