"""Samples of a prior at candidate poses, and the score terms that follow from them."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int
from numpy import ndarray as Array

from dav_gswt.files import locate_path
from dav_gswt.images.lpips_weights import Weights, read
from dav_gswt.logs import progress
from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.threads import default_threads, map_in_single_threads
from dav_gswt.views import terms
from dav_gswt.views.uncertainty import w2_sq

BATCH = 4  # poses sampled at a time: as fast as more at once, and few enough that every thread has some


@dataclass(frozen=True)
class PriorConfig:
    """A prior and its sampling settings.

    samples: per pose. steps: of denoising. p_drop: attention dropout. weights: of LPIPS; None leaves its terms out.
    """

    model: Prior
    samples: int
    steps: int
    p_drop: float
    seed: int = 0
    weights: Weights | None = None


def open_prior(entry: dict, p_drop: float, seed: int, lpips_file: Path | str | None = None) -> PriorConfig:
    """Open an entry of `priors` of the config. lpips_file: weights of LPIPS; None leaves its terms out.

    Raises: InputError: weights of the prior or of LPIPS are missing or invalid.
    """
    weights = None if lpips_file is None else read(lpips_file)
    return PriorConfig(load_prior(entry), entry["samples"], entry["steps"], p_drop, seed, weights)


def load_prior(entry: dict) -> Prior:
    """Load the model of an entry of `priors`. Raises: InputError: its weights are missing or invalid."""
    if entry["model"] == "terrain":
        from dav_gswt.prior.terrain import TerrainPrior  # not above: diffusers takes seconds to load
        from dav_gswt.prior.weights import TERRAIN_WEIGHTS

        return TerrainPrior.open(locate_path(entry.get("weights", TERRAIN_WEIGHTS)))
    from dav_gswt.prior.zero123 import Zero123

    return Zero123.open(locate_path(entry["weights"]))


SampledTerms = dict[str, Array]  # by name the terms of poses, row by row, and `maps` of w2_sq, in cells of the latents


def sample_terms(
    prior: PriorConfig, condition: Condition, names: list[str], masks: Float32[Array, "n s s"]
) -> SampledTerms:
    """Compute the terms of every pose.

    masks: 1 for pixels that look at the modelled ground. w2_sq is the mean over these (0 if there are none), and LPIPS
    sees only these; maps and gradient are of the whole picture.
    Raises: ValueError: fewer than 2 samples, p_drop outside [0, 1), something not finite, naming the poses.
    """
    parts = [np.arange(len(condition))[i : i + BATCH] for i in range(0, len(condition), BATCH)]

    def worker(own: PriorConfig) -> Callable[[Int[Array, "b"]], SampledTerms]:
        return lambda r: _sample_batch(own, condition[r], [names[i] for i in r], masks[r])

    more = min(default_threads(), len(parts)) - 1 if prior.model.small else 0
    own = [prior, *(replace(prior, model=deepcopy(prior.model)) for _ in range(more))]
    made = map_in_single_threads([worker(each) for each in own], parts)
    found = [part for _, part in zip(progress(parts, "sample poses"), made, strict=True)]
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}


def _sample_batch(
    prior: PriorConfig, condition: Condition, names: list[str], masks: Float32[Array, "k s s"]
) -> SampledTerms:
    latents = prior.model.sample(condition, prior.samples, prior.p_drop, prior.steps, prior.seed)
    maps, pictures = w2_sq(latents, names=names)[1], prior.model.decode(latents)[..., :3]
    drawn = terms.Samples(condition, maps, pictures, masks, prior.weights, prior.p_drop == 0)
    return terms.compute_terms(drawn) | {"maps": maps}
