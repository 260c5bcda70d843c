"""Other uncertainty estimates, as controls for the disagreement of the prior's samples.

`spread`: how far samples from other noises lie apart, without dropout: what the prior itself holds for possible.
`residual`: how far the mean of these lies from what the field shows. Of deterministic networks of the prior's shape:
`regressor_dropout` under dropout masks, `regressor_residual`, and `ensemble`, how far they lie apart.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.prior.interface import Condition
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.study.prior.regressor import Regressor
from dav_gswt.views.prior_sampling import PriorConfig
from dav_gswt.views.uncertainty import w2_sq


def open_regressors(files: Sequence[Path | str]) -> list[Regressor]:
    """Raises: InputError: weights that are not a regressor's."""
    return [Regressor.open(file) for file in files]


def control_maps(
    prior: PriorConfig, regressors: Sequence[Regressor], condition: Condition
) -> dict[str, Float32[Array, "n h w"]]:
    """Each estimate's map of every view, in cells of the latents; those of the project's own prior alone."""
    if not isinstance(prior.model, TerrainPrior):
        return {}
    render = prior.model.encode_render(condition)
    drawn = prior.model.sample(condition, prior.samples, 0.0, prior.steps, prior.seed, common=False)
    found = {"spread": w2_sq(drawn)[1], "residual": _squared_distance(drawn.mean(1), render)}
    if regressors:
        first = regressors[0]
        dropped = first.sample(condition, prior.samples, prior.p_drop, prior.seed)
        codes = np.stack([r.predict(condition) for r in regressors], 1)
        found |= {"regressor_dropout": w2_sq(dropped)[1], "regressor_residual": _squared_distance(codes[:, 0], render)}
        if len(regressors) > 1:
            found["ensemble"] = w2_sq(codes)[1]
    return found


def _squared_distance(code: Float32[Array, "n c h w"], render: Float32[Array, "n c h w"]) -> Float32[Array, "n h w"]:
    return ((code - render) ** 2).sum(1)
