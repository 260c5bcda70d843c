"""Other uncertainty estimates, as controls for the disagreement of the prior's samples.

`spread`: how far samples from other noises lie apart, without dropout: what the prior itself holds for possible.
`residual`: how far the mean of these lies from what the field shows.
"""

from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.prior.interface import Condition
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.views.prior_sampling import PriorConfig
from dav_gswt.views.uncertainty import w2_sq


def control_maps(prior: PriorConfig, condition: Condition) -> dict[str, Float32[Array, "n h w"]]:
    """Each estimate's map of every view, in cells of the latents; those of the project's own prior alone."""
    if not isinstance(prior.model, TerrainPrior):
        return {}
    render = prior.model.encode_render(condition)
    drawn = prior.model.sample(condition, prior.samples, 0.0, prior.steps, prior.seed, common=False)
    return {"spread": w2_sq(drawn)[1], "residual": _squared_distance(drawn.mean(1), render)}


def _squared_distance(code: Float32[Array, "n c h w"], render: Float32[Array, "n c h w"]) -> Float32[Array, "n h w"]:
    return ((code - render) ** 2).sum(1)
