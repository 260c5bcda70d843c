"""Inpainted views: what a prior generates for unseen pixels, with its colours matched to the known surroundings."""

from dataclasses import dataclass
from typing import Protocol, cast, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.threads import one_thread
from dav_gswt.views.prior_sampling import PriorConfig

CELL = 4  # pixels per side of a cell of the latent, the unit of the mask of valid pixels
SPREAD = 0.1  # pictures: how far a colour difference at the border of unseen pixels reaches into them
FAR_WEIGHT = 0.05  # of the ground's mean colour, which prevails far from known pixels
LEAST_ALPHA = 0.5  # by which a colour over black is divided, at least


@runtime_checkable
class Inpainter(Prior, Protocol):
    """A prior that accepts a mask of the valid cells of the render, and that has depth."""

    def sample(
        self,
        condition: Condition,
        m: int,
        p_drop: float,
        steps: int,
        seed: int,
        common: bool = True,
        known: Bool[Array, "b h w"] | None = None,
    ) -> Float32[Array, "b m c hz wz"]:
        """As `Prior.sample`. known: cells of CELL x CELL pixels whose render is valid; None: all."""
        ...


@dataclass(frozen=True)
class InpaintedViews:
    """b pictures: colours as if opaque, opacity, and inverse depth (flying height over depth)."""

    colour: Float32[Array, "b s s 3"]
    alpha: Float32[Array, "b s s"]
    inverse_depth: Float32[Array, "b s s"]


def inpaint_views(
    config: PriorConfig, condition: Condition, unseen: Bool[Array, "b s s"], ground: Float[Array, "3"]
) -> InpaintedViews:
    """The mean of a prior's samples, without dropout, each from its own noise, with `match_colours` applied.

    The mean is less sharp than one sample, but invents less (docs/prior.md has figures).

    Args:    unseen: pixels that show what no photo saw; cells with such a pixel are not valid. ground: mean colour of
             the ground that photos saw.
    Raises:  ValueError: the prior has no depth, or gives something that is not finite.
    """
    model = cast(Inpainter, config.model)
    b, size = len(condition), condition.colour.shape[1]
    touched = unseen.reshape(b, size // CELL, CELL, size // CELL, CELL).any((2, 4))
    known = np.logical_not(touched)
    with one_thread():
        latents = model.sample(condition, config.samples, 0.0, config.steps, config.seed, known=known, common=False)
        views = model.decode(latents)
    if views.inverse_depth is None:
        raise ValueError(f"the prior {model.name} has no depth: its pixels have no place in the scene")
    rgba, inverse_depth = (a.mean(1, dtype=np.float32) for a in (views.rgba, views.inverse_depth))
    if bad := [i for i in range(b) if not (np.isfinite(rgba[i]).all() and np.isfinite(inverse_depth[i]).all())]:
        raise ValueError(f"the prior's picture of view {bad[0]} is not finite")
    alpha = rgba[..., 3]
    colour = rgba[..., :3] / np.maximum(alpha, LEAST_ALPHA)[..., None]
    certain = ~unseen & (condition.alpha > 0.9)
    each = zip(colour, condition.colour, certain, unseen, strict=True)
    return InpaintedViews(np.stack([match_colours(*view, ground) for view in each]), alpha, inverse_depth)


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
