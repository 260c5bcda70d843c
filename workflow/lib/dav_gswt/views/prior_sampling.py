"""Uncertainty terms from samples of a prior: their disagreement in latents and in pictures."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int
from numpy import ndarray as Array

from dav_gswt.images.lpips_weights import Weights, read
from dav_gswt.logs import progress
from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.views.uncertainty import staging
from dav_gswt.views.uncertainty.disagreement import w2_sq
from dav_gswt.views.uncertainty.staging import PriorTerms
from dav_gswt.views.uncertainty.texture import image_gradient

_log = logging.getLogger(__name__)

BATCH = 16  # poses sampled at a time
CHEAP = 2  # denoising steps of the first of two stages
FEW = 2 * (staging.TOP + staging.BATCH)  # up to so many poses a single stage costs less


@dataclass(frozen=True)
class PriorConfig:
    """A prior and its sampling settings.

    samples: per pose. steps: of denoising. p_drop: attention dropout. weights: of LPIPS; None leaves its terms out.
    staged: score all poses with few steps first, then the best in full. posterior: a sample is a distribution with the
    variance of the coder, instead of a point. independent_noise: independent initial noise for each sample.
    """

    model: Prior
    samples: int
    steps: int
    p_drop: float
    seed: int = 0
    weights: Weights | None = None
    staged: bool = True
    posterior: bool = False
    independent_noise: bool = False


def open_scoring_prior(
    entry: dict | None, p_drop: float, seed: int, lpips_file: Path | str | None
) -> PriorConfig | None:
    """Open an entry of `priors` of the config for scoring; None for None.

    lpips_file: weights of LPIPS; None leaves its terms out, with a warning.
    Raises: InputError: weights of the prior or of LPIPS are missing or invalid.
    """
    if entry is None:
        return None
    if lpips_file is None:
        _log.warning("LPIPS is switched off: scores have no such term")
    weights = None if lpips_file is None else read(lpips_file)
    how = {
        name: entry[name] for name in ("samples", "steps", "staged", "posterior", "independent_noise") if name in entry
    }
    return PriorConfig(load_prior(entry), p_drop=p_drop, seed=seed, weights=weights, **how)


def open_inpainting_prior(entry: dict, seed: int) -> PriorConfig:
    """Open an entry of `priors` for inpainting, without dropout."""
    return PriorConfig(load_prior(entry), entry["samples"], entry["steps"], 0.0, seed)


def load_prior(entry: dict) -> Prior:
    """Load the model of an entry of `priors`. Raises: InputError: its weights are missing or invalid."""
    if entry["model"] == "terrain":
        from dav_gswt.prior.terrain import TerrainPrior  # not above: diffusers takes seconds to load
        from dav_gswt.prior.weights import TERRAIN_WEIGHTS

        return TerrainPrior.open(entry.get("weights", TERRAIN_WEIGHTS))
    from dav_gswt.prior.zero123 import GUIDANCE, Zero123

    return Zero123.open(entry["folder"], entry.get("guidance", GUIDANCE))


def sample_terms(
    prior: PriorConfig, condition: Condition, names: list[str], counts: Float32[Array, "n s s"]
) -> tuple[PriorTerms, Int[Array, "n"]]:
    """Compute the terms of every pose, and the denoising steps used for each.

    counts: 1 for pixels that look at the modelled ground. w2_sq is the mean over these (0 if there are none), and LPIPS
    sees only these; maps and gradient are of the whole picture.
    Raises: ValueError: fewer than 2 samples, p_drop outside [0, 1), something not finite, naming the poses.
    """
    n = len(condition)

    def of(rows: Int[Array, "k"], steps: int, what: str) -> PriorTerms:
        parts = [rows[i : i + BATCH] for i in range(0, len(rows), BATCH)]
        made = (
            _sample_batch(prior, condition[r], [names[i] for i in r], steps, counts[r]) for r in progress(parts, what)
        )
        return _concatenate(list(made))

    if not prior.staged or n <= FEW or prior.steps <= CHEAP:
        return of(np.arange(n), prior.steps, "sample poses"), np.full(n, prior.steps)
    found, full = staging.score_in_stages(
        n, lambda rows: of(rows, CHEAP, "sample poses"), lambda rows: of(rows, prior.steps, "sample best poses")
    )
    share = (n * CHEAP + int(full.sum()) * prior.steps) / (n * prior.steps)
    _log.info("%d of %d poses were sampled in full: %.0f %% of the cost of all", full.sum(), n, 100 * share)
    return found, np.where(full, prior.steps, CHEAP)


def _sample_batch(
    prior: PriorConfig, condition: Condition, names: list[str], steps: int, counts: Float32[Array, "k s s"]
) -> PriorTerms:
    asked = condition, prior.samples, prior.p_drop, steps, prior.seed
    latents = prior.model.sample(*asked, common=not prior.independent_noise)
    wide = prior.model.estimate_variances(latents) if prior.posterior else None
    _, maps = w2_sq(latents, wide, names)
    pictures = prior.model.decode(latents).rgba[..., :3]
    between = single = None
    if prior.weights is not None:
        from dav_gswt.images import lpips  # not above: torch takes seconds to load, and most scoring does without

        between = lpips.pairwise_mean((2 * pictures - 1) * counts[:, None, :, :, None], prior.weights)
        if prior.p_drop == 0 and not prior.independent_noise:
            one, render = ((2 * p - 1) * counts[..., None] for p in (pictures[:, 0], condition.colour))
            single = lpips.distance(one, render, prior.weights)
    apart = ((latents.mean(1) - prior.model.encode_render(condition)) ** 2).sum(1)
    return PriorTerms(
        weighted_mean(maps, counts),
        between,
        image_gradient(pictures, names=names),
        maps,
        single,
        weighted_mean(apart, counts),
    )


def weighted_mean(maps: Float32[Array, "n h w"], counts: Float32[Array, "n s s"]) -> Float64[Array, "n"]:
    """Mean of each map weighted by the share of counted pixels in a cell; 0 if there are none."""
    n, h, w = maps.shape
    cells = counts.reshape(n, h, counts.shape[1] // h, w, counts.shape[2] // w).mean((2, 4), dtype=np.float64)
    return (maps * cells).sum((1, 2)) / np.maximum(cells.sum((1, 2)), 1e-9)


def _concatenate(parts: list[PriorTerms]) -> PriorTerms:
    columns = zip(*(vars(p).values() for p in parts), strict=True)
    return PriorTerms(*(None if column[0] is None else np.concatenate(column) for column in columns))
