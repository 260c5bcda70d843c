"""Inpainted views: what a prior generates for unseen pixels, with its colours matched to the known surroundings."""

from typing import TYPE_CHECKING, cast

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.prior.interface import Condition
from dav_gswt.threads import one_thread
from dav_gswt.views.prior_sampling import PriorConfig

if TYPE_CHECKING:
    import dav_gswt.prior.terrain

CELL = 4  # pixels per side of a cell of the latent, the unit of the mask of valid pixels
SPREAD = 0.1  # pictures: how far a colour difference at the border of unseen pixels reaches into them
FAR_WEIGHT = 0.05  # of the ground's mean colour, which prevails far from known pixels
LEAST_ALPHA = 0.5  # by which a colour over black is divided, at least


def inpaint_view(
    config: PriorConfig, condition: Condition, unseen: Bool[Array, "s s"], ground: Float[Array, "3"]
) -> tuple[Float32[Array, "s s 3"], Float32[Array, "s s"]]:
    """Colours as if opaque, and opacity, of one view: the mean of a prior's samples after `match_colours`.

    The samples have no dropout, each starts from its own noise. Their mean is less sharp than one sample, but invents
    less.

    Args:    config: of the terrain prior; no other prior takes a mask of valid cells. condition: of one view. unseen:
             pixels that show what no photo saw; cells with such a pixel are not valid. ground: mean colour of the
             ground that photos saw.
    Raises:  ValueError: the prior gives something that is not finite.
    """
    model = cast("dav_gswt.prior.terrain.TerrainPrior", config.model)
    size = len(unseen)
    touched = unseen.reshape(size // CELL, CELL, size // CELL, CELL).any((1, 3))
    with one_thread():
        known = np.logical_not(touched)[None]
        latents = model.sample(condition, config.samples, 0.0, config.steps, config.seed, known=known, common=False)
        rgba = model.decode(latents).rgba[0].mean(0, dtype=np.float32)
    if not np.isfinite(rgba).all():
        raise ValueError("the prior's picture of a view is not finite")
    alpha, render = rgba[..., 3], condition.colour[0]
    colour = rgba[..., :3] / np.maximum(alpha, LEAST_ALPHA)[..., None]
    certain = ~unseen & (condition.alpha[0] > 0.9)
    return match_colours(colour, render, certain, unseen, ground), alpha


def match_colours(
    picture: Float32[Array, "s s 3"],
    render: Float32[Array, "s s 3"],
    known: Bool[Array, "s s"],
    unseen: Bool[Array, "s s"],
    ground: Float[Array, "3"],
) -> Float32[Array, "s s 3"]:
    """Shift the colours of a picture to those of the render in known pixels, without a drift between pictures.

    The shift is a Gaussian-weighted mean (SPREAD pictures wide) of the differences in known pixels; far from all of
    them it moves the mean of the unseen pixels to the colour of the ground. known and unseen are disjoint; other pixels
    (the sky) are in neither.
    """
    sigma, difference = SPREAD * len(known), (render - picture).astype(float)
    if unseen.any():
        far = ground - picture[unseen].mean(0, dtype=float)
    else:
        far = difference[known].sum(0) / max(1, known.sum())
    near = gaussian_filter(known.astype(float), sigma, mode="nearest")
    sums = [gaussian_filter(known * difference[..., c], sigma, mode="nearest") for c in range(3)]
    shift = (np.stack(sums, -1) + FAR_WEIGHT * far) / (near + FAR_WEIGHT)[..., None]
    return np.clip(picture + shift, 0, 1).astype(np.float32)
