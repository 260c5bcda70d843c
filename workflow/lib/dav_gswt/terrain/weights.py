"""Level-of-detail weights by distance, and the opacity of a Gaussian that is drawn with a weight.

The viewer's shader (draw/shaders.js) computes the same weights; tests/golden/weights.json holds both to them.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

MAX_OPACITY = 1 - 1e-6  # an opaque Gaussian of weight 0 would otherwise be 0 * -infinity


def finer_share(distance: Float[Array, "n"], switch: float, band: float, smooth: bool = False) -> Float[Array, "n"]:
    """Share of the finer of two levels at a distance d from the eye: clip(1/2 - (d - switch) / (2 band), 0, 1).

    1 nearer than switch - band, 0 beyond switch + band; band = 0 is a step with 1/2 at the switch; an infinite switch
    is never reached. smooth: s^2 (3 - 2 s) of it, which has a continuous slope.
    Source: DAV-GSWT, Eq. (lod_blend); see docs/research/deviations.md on its "0 otherwise".
    """
    if switch == np.inf:
        return np.ones_like(distance)
    if band > 0:
        with np.errstate(over="ignore"):
            share = np.clip(0.5 - (distance - switch) / (2 * band), 0.0, 1.0)
    else:
        share = np.where(distance < switch, 1.0, np.where(distance > switch, 0.0, 0.5))
    return share * share * (3 - 2 * share) if smooth else share


def level_weights(
    distance: Float[Array, "n"], switches: list[float], bands: list[float], smooth: bool = False
) -> Float[Array, "levels n"]:
    """Weight of each level at a distance: the first takes its share, each next one its share of the rest.

    The last level takes the whole rest, so weights are never negative and sum to 1, also where bands overlap.
    switches, bands: of each level against the next, the last (infinite) included.
    """
    rest, weights = np.ones_like(distance), []
    for switch, band in zip(switches[:-1], bands[:-1], strict=True):
        share = finer_share(distance, switch, band, smooth)
        weights.append(rest * share)
        rest = rest * (1 - share)
    return np.stack([*weights, rest])


def crossfade_opacity(opacity: Float[Array, "n"], weight: Float[Array, "n"]) -> Float[Array, "n"]:
    """Opacity of a Gaussian drawn with a weight w: 1 - (1 - opacity)^w, exactly the opacity at 1 and 0 at 0.

    Transmittances multiply, so two equal Gaussians of weights w and 1 - w hide as much as one; a linear fade of 0.9
    would dip to 0.7 half-way. Computed as -expm1(w log1p(-opacity)), with opacity at most MAX_OPACITY for 0 < w < 1.
    """
    partial = -np.expm1(weight * np.log1p(-np.minimum(opacity, MAX_OPACITY)))
    return np.where(weight == 1, opacity, np.where(weight == 0, 0.0, partial))
