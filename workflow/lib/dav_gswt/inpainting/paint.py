"""What a prior paints where no photo looked, brought to the level of what is known around it."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.threads import one_thread
from dav_gswt.views.prior_sampling import PriorConfig

CELL = 4  # pixels a side of a cell of the code: what a prior believes or not
SPREAD = 0.1  # pictures: how far a difference of colour at the border of the unknown reaches into it
FAR = 0.05  # weight of the ground's mean colour beside it, which is what is left farther away
LEAST_ALPHA = 0.5  # by which a colour over black is divided, at least


@runtime_checkable
class Painter(Prior, Protocol):
    """A prior that can be told which cells of a render not to believe, and that knows depth."""

    def sample(
        self,
        condition: Condition,
        m: int,
        p_drop: float,
        steps: int,
        seed: int,
        known: Bool[Array, "b h w"] | None = None,
        common: bool = True,
    ) -> Float32[Array, "b m c hz wz"]:
        """As `Prior.sample`. known: cells of CELL x CELL pixels whose render is to be believed; None: all."""


@dataclass(frozen=True)
class Painted:
    """b pictures: colours as if they were opaque, opacity, flying heights over depth."""

    colour: Float32[Array, "b s s 3"]
    alpha: Float32[Array, "b s s"]
    inverse_depth: Float32[Array, "b s s"]


def painted(
    asked: PriorConfig, condition: Condition, unseen: Bool[Array, "b s s"], ground: Float[Array, "3"]
) -> Painted:
    """The mean of a prior's samples, without dropout, each from a noise of its own; levelled (see there).

    A mean, not one sample, which is sharper, but makes up what is not there (docs/prior.md has both). unseen: pixels
    that show what no photo saw; the cells that have one are not believed. ground: mean colour of what photos saw.
    Raises: ValueError: the prior has no depth, or gives something that is not finite.
    """
    b, size = len(condition), condition.colour.shape[1]
    known = ~unseen.reshape(b, size // CELL, CELL, size // CELL, CELL).any((2, 4))
    with one_thread():
        latents = asked.model.sample(condition, asked.samples, 0.0, asked.steps, asked.seed, known=known, common=False)
        made = asked.model.decode(latents)
    if made.inverse_depth is None:
        raise ValueError(f"the prior {asked.model.name} has no depth: it cannot say what it painted where")
    rgba, inverse_depth = (a.mean(1, dtype=np.float32) for a in (made.rgba, made.inverse_depth))
    if bad := [i for i in range(b) if not (np.isfinite(rgba[i]).all() and np.isfinite(inverse_depth[i]).all())]:
        raise ValueError(f"the prior's picture of view {bad[0]} is not finite")
    alpha = rgba[..., 3]
    colour = rgba[..., :3] / np.maximum(alpha, LEAST_ALPHA)[..., None]
    sure = ~unseen & (condition.alpha > 0.9)
    each = zip(colour, condition.colour, sure, unseen, strict=True)
    return Painted(np.stack([levelled(*one, ground) for one in each]), alpha, inverse_depth)


def levelled(
    picture: Float32[Array, "s s 3"],
    render: Float32[Array, "s s 3"],
    known: Bool[Array, "s s"],
    unseen: Bool[Array, "s s"],
    ground: Float[Array, "3"],
) -> Float32[Array, "s s 3"]:
    """The picture with its colours shifted to join the render, and not to drift away from one picture to the next.

    The shift is the mean of the differences over known pixels, near ones before far ones (a Gaussian of SPREAD
    pictures); far from all of them it takes the mean of the unseen pixels to the colour of the ground. known and unseen
    share no pixel; others (the sky) belong to neither.
    """
    sigma, apart = SPREAD * len(known), (render - picture).astype(float)
    far = ground - picture[unseen].mean(0, dtype=float) if unseen.any() else apart[known].sum(0) / max(1, known.sum())
    near = gaussian_filter(known.astype(float), sigma, mode="nearest")
    sums = [gaussian_filter(known * apart[..., c], sigma, mode="nearest") for c in range(3)]
    shift = (np.stack(sums, -1) + FAR * far) / (near + FAR)[..., None]
    return np.clip(picture + shift, 0, 1).astype(np.float32)
