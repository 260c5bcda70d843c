"""Score terms: functions that say how much a photo from each candidate pose would tell.

To add one, write its function here and decorate it with `@term(name, ...)`: columns of scores.csv and scales follow
from the decorator. A term without a prior is computed from `Renders` of all candidates; a term with a prior from
`Samples` of some of them, and may be None where the prior's settings leave it out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float32, Float64
from numpy import ndarray as Array

from dav_gswt.images.lpips_weights import Weights
from dav_gswt.prior.interface import Condition
from dav_gswt.views.coverage import CellViews, DirectionalCoverage, GroundCells
from dav_gswt.views.uncertainty import image_gradient


@dataclass(frozen=True)
class Renders:
    """What renders of the field at n candidates show.

    uncertainty: rendered uncertainty of each pixel. masks: 1 for the pixels that look at the modelled ground. seen,
    taken: the cells of the ground in the pictures of the candidates and of the photos so far.
    """

    uncertainty: list[Float32[Array, "_ _"]]
    masks: list[Float32[Array, "_ _"]]
    cells: GroundCells
    seen: CellViews
    taken: CellViews


@dataclass(frozen=True)
class Samples:
    """What a prior draws at n candidates.

    maps: w2_sq of the latents by pixel. masks: 1 for the pixels of a picture that look at the modelled ground. weights:
    of LPIPS, None without. plain: no dropout and common noise, so that all samples of a pose are one.
    """

    condition: Condition
    maps: Float32[Array, "n h w"]
    pictures: Float32[Array, "n m s s 3"]
    masks: Float32[Array, "n s s"]
    weights: Weights | None
    plain: bool


@dataclass(frozen=True)
class Term:
    """A term. requires: what a user must set to get it; empty: nothing."""

    compute: Callable[[Any], Float64[Array, "n"] | None]
    source: type
    requires: str


TERMS: dict[str, Term] = {}


def term(name: str, source: type = Samples, requires: str = "a prior (docs/prior.md)") -> Callable:
    """Register a function as a term; see `Term`."""

    def register(function: Callable) -> Callable:
        TERMS[name] = Term(function, source, requires)
        return function

    return register


def compute_terms(given: Renders | Samples) -> dict[str, Float64[Array, "n"]]:
    """The available terms by name."""
    found = {name: each.compute(given) for name, each in TERMS.items() if isinstance(given, each.source)}
    return {name: values for name, values in found.items() if values is not None}


@term("opacity", Renders, requires="")
def opacity(given: Renders) -> Float64[Array, "n"]:
    """Mean of the rendered uncertainty over pixels on the modelled ground; 0 if there are none."""
    pairs = zip(given.uncertainty, given.masks, strict=True)
    return np.array([float((seen * mask).sum() / max(1.0, mask.sum())) for seen, mask in pairs], float)


@term("coverage", Renders, requires="")
def coverage(given: Renders) -> Float64[Array, "n"]:
    """Gain in directional coverage over the photos so far, all cells alike."""
    return np.array(DirectionalCoverage(given.cells, given.taken, given.seen).gains(), float)


@term("w2_sq")
def disagreement(given: Samples) -> Float64[Array, "n"]:
    """Squared W2 of the samples' latents, mean over the cells that look at the modelled ground."""
    return weighted_mean(given.maps, given.masks)


@term("lpips")
def perceptual_disagreement(given: Samples) -> Float64[Array, "n"] | None:
    """Mean LPIPS between the pairs of samples, where they look at the modelled ground."""
    if given.weights is None:
        return None
    from dav_gswt.images import lpips  # not above: torch takes seconds to load, and most scoring does without

    return lpips.pairwise_mean((2 * given.pictures - 1) * given.masks[:, None, :, :, None], given.weights)


@term("gradient")
def texture(given: Samples) -> Float64[Array, "n"]:
    """Image gradient of the mean picture, a part of the paper's u_img."""
    return image_gradient(given.pictures)


@term(
    "single",
    requires="a prior without dropout (p_drop 0), and the config's `lpips` as `installed` or a path "
    "(workflow/schemas/config.schema.json)",
)
def single(given: Samples) -> Float64[Array, "n"] | None:
    """LPIPS between the only sample and the render; None with dropout."""
    if given.weights is None or not given.plain:
        return None
    from dav_gswt.images import lpips  # as above

    one, render = ((2 * p - 1) * given.masks[..., None] for p in (given.pictures[:, 0], given.condition.colour))
    return lpips.distance(one, render, given.weights)


def weighted_mean(maps: Float32[Array, "n h w"], masks: Float32[Array, "n s s"]) -> Float64[Array, "n"]:
    """Mean of each map weighted by the share of counted pixels in a cell; 0 if there are none."""
    n, h, w = maps.shape
    cells = masks.reshape(n, h, masks.shape[1] // h, w, masks.shape[2] // w).mean((2, 4), dtype=np.float64)
    return (maps * cells).sum((1, 2)) / np.maximum(cells.sum((1, 2)), 1e-9)
