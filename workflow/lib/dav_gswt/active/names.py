"""Names of the policies, apart from their code: the workflow reads them without loading the numerics."""

POLICIES = ("farthest", "opacity", "random", "given")  # given: a finished field, no round of views
