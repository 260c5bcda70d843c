"""Names of the policies, apart from their code: the workflow reads them without loading the numerics."""

GEOMETRIC = ("farthest", "opacity", "random")  # read no prior: they have one spelling of it
IMAGINING = ("w2-lpips",)
POLICIES = (*GEOMETRIC, *IMAGINING, "given")  # given: a finished field, no round of views

# Agents that are devices or people, and the module that speaks to each.
DEVICES = {"serial": "rig", "plan": "mission", "handheld": "walk"}
