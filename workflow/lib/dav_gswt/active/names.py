"""Names of the policies, apart from their code: the workflow reads them without loading the numerics."""

POLICIES = ("farthest", "opacity", "random", "given")  # given: a finished field, no round of views

# Agents that are devices or people, and the module that speaks to each.
DEVICES = {"serial": "rig", "plan": "mission", "handheld": "walk"}
