"""The terms of a pose's uncertainty that a prior gives: how much its samples disagree, in latents and in pictures."""

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

AT_ONCE = 16  # poses that are imagined at a time
CHEAP = 2  # steps of denoising in the first of two stages
FEW = 2 * (staging.TOP + staging.BATCH)  # poses of which so many would be imagined in full that one stage costs less


@dataclass(frozen=True)
class PriorConfig:
    """A prior and how it is asked. samples of each pose; steps of denoising; p_drop: of its attention; weights: of
    LPIPS, None where they are not had; staged: cheaply first, in full where it matters; posterior: a sample is a
    distribution, as wide as the coder says, instead of a point; independent_noise: each sample starts from its own."""

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
    """A config's entry of `priors`; None for none. Without LPIPS's weights its term is absent, and that is said.

    Raises: InputError: the prior's weights, or LPIPS's, are missing or not what they should be.
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
    """A config's entry of `priors`, to be asked for pictures, without dropout."""
    return PriorConfig(load_prior(entry), entry["samples"], entry["steps"], 0.0, seed)


def load_prior(entry: dict) -> Prior:
    """The prior of a config's entry. Raises: InputError: its weights are missing or not to be trusted."""
    if entry["model"] == "terrain":
        from dav_gswt.prior.terrain import TerrainPrior  # not above: diffusers takes seconds to load
        from dav_gswt.prior.weights import TERRAIN_WEIGHTS

        return TerrainPrior.open(entry.get("weights", TERRAIN_WEIGHTS))
    from dav_gswt.prior.zero123 import GUIDANCE, Zero123

    return Zero123.open(entry["folder"], entry.get("guidance", GUIDANCE))


def sample_terms(
    prior: PriorConfig, condition: Condition, names: list[str], counts: Float32[Array, "n s s"]
) -> tuple[PriorTerms, Int[Array, "n"]]:
    """The terms of every pose, and the steps of denoising that they rest on.

    counts: 1 for the pixels that matter, those that look at the modelled ground: w2_sq is the mean over these (0 where
    there is none), and LPIPS sees no others; the maps and the gradient are of the whole picture.
    Raises: ValueError: fewer than 2 samples, p_drop outside [0, 1), something not finite, naming the poses.
    """
    n = len(condition)

    def of(rows: Int[Array, "k"], steps: int, what: str) -> PriorTerms:
        parts = [rows[i : i + AT_ONCE] for i in range(0, len(rows), AT_ONCE)]
        made = (
            _sample_batch(prior, condition[r], [names[i] for i in r], steps, counts[r]) for r in progress(parts, what)
        )
        return _concatenate(list(made))

    if not prior.staged or n <= FEW or prior.steps <= CHEAP:
        return of(np.arange(n), prior.steps, "imagine poses"), np.full(n, prior.steps)
    found, full = staging.score_in_stages(
        n, lambda rows: of(rows, CHEAP, "imagine poses"), lambda rows: of(rows, prior.steps, "imagine best poses")
    )
    share = (n * CHEAP + int(full.sum()) * prior.steps) / (n * prior.steps)
    _log.info("%d of %d poses were imagined in full: %.0f %% of the cost of all", full.sum(), n, 100 * share)
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
    """Mean of each map over the pixels that count, those of a cell together; 0 where none does."""
    n, h, w = maps.shape
    cells = counts.reshape(n, h, counts.shape[1] // h, w, counts.shape[2] // w).mean((2, 4), dtype=np.float64)
    return (maps * cells).sum((1, 2)) / np.maximum(cells.sum((1, 2)), 1e-9)


def _concatenate(parts: list[PriorTerms]) -> PriorTerms:
    columns = zip(*(vars(p).values() for p in parts), strict=True)
    return PriorTerms(*(None if column[0] is None else np.concatenate(column) for column in columns))
