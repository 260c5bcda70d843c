"""Values by which candidate poses are coloured in figures and in three dimensions."""

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.views.policies import uncertainty
from dav_gswt.views.scores import Scores

HIGHEST = 0.98  # quantile of all values at which colours end


def candidate_values(scores: Scores, lam: float) -> tuple[str, Float64[Array, "n"]]:
    """Label and values by which candidates are coloured: the uncertainty u, or the gain in coverage without a prior or
    without dropout, where all samples agree."""
    if scores.scales.by_term.get("w2_sq", 0.0) > 0:
        lpips = f" + {lam:g} LPIPS" if lam and "lpips" in scores.terms else ""
        return f"uncertainty u = W2{lpips}, in units of the scale frozen at round 1", uncertainty(scores, lam)
    scale, values = scores.scales.by_term["coverage"], scores.term("coverage")
    values = values / scale if scale > 0 else np.zeros(len(scores))
    return "gain in coverage of the ground, in units of the scale frozen at round 1", values
