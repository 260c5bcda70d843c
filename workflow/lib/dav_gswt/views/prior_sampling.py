"""Uncertainty terms from samples of a prior: their disagreement in latents and in pictures."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int
from numpy import ndarray as Array

from dav_gswt.files import locate_path
from dav_gswt.images.lpips_weights import Weights, read
from dav_gswt.logs import progress
from dav_gswt.prior.interface import Condition, CopyablePrior, Prior
from dav_gswt.threads import default_threads, map_in_single_threads
from dav_gswt.views.uncertainty import staging
from dav_gswt.views.uncertainty.disagreement import w2_sq
from dav_gswt.views.uncertainty.staging import PriorTerms
from dav_gswt.views.uncertainty.texture import image_gradient

_log = logging.getLogger(__name__)

BATCH = 4  # poses sampled at a time: as fast as more at once, and few enough that every thread has some
CHEAP = 2  # denoising steps of the first of two stages
FEW = 2 * (staging.TOP + staging.BATCH)  # up to so many poses a single stage costs less


@dataclass(frozen=True)
class PriorConfig:
    """A prior and its sampling settings.

    samples: per pose. steps: of denoising. p_drop: attention dropout. weights: of LPIPS; None leaves its terms out.
    staged: score all poses with few steps first, then the best in full.
    """

    model: Prior
    samples: int
    steps: int
    p_drop: float
    seed: int = 0
    weights: Weights | None = None
    staged: bool = True


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
        _log.warning(
            "LPIPS is switched off: scores have no such term; see the keys `lpips` in docs/reference/config.md"
        )
    weights = None if lpips_file is None else read(lpips_file)
    settings = {name: entry[name] for name in ("samples", "steps", "staged") if name in entry}
    return PriorConfig(load_prior(entry), p_drop=p_drop, seed=seed, weights=weights, **settings)


def open_inpainting_prior(entry: dict, seed: int) -> PriorConfig:
    """Open an entry of `priors` for inpainting, without dropout."""
    return PriorConfig(load_prior(entry), entry["samples"], entry["steps"], 0.0, seed)


def load_prior(entry: dict) -> Prior:
    """Load the model of an entry of `priors`. Raises: InputError: its weights are missing or invalid."""
    if entry["model"] == "terrain":
        from dav_gswt.prior.terrain import TerrainPrior  # not above: diffusers takes seconds to load
        from dav_gswt.prior.weights import TERRAIN_WEIGHTS

        return TerrainPrior.open(locate_path(entry.get("weights", TERRAIN_WEIGHTS)))
    from dav_gswt.prior.zero123 import Zero123

    return Zero123.open(locate_path(entry["folder"]))


def sample_terms(
    prior: PriorConfig, condition: Condition, names: list[str], masks: Float32[Array, "n s s"]
) -> tuple[PriorTerms, Int[Array, "n"]]:
    """Compute the terms of every pose, and the denoising steps used for each.

    masks: 1 for pixels that look at the modelled ground. w2_sq is the mean over these (0 if there are none), and LPIPS
    sees only these; maps and gradient are of the whole picture.
    Raises: ValueError: fewer than 2 samples, p_drop outside [0, 1), something not finite, naming the poses.
    """
    n, copies = len(condition), _copy_for_threads(prior, -(-len(condition) // BATCH))

    def sample_rows(rows: Int[Array, "k"], steps: int, what: str) -> PriorTerms:
        parts = [rows[i : i + BATCH] for i in range(0, len(rows), BATCH)]

        def worker(own: PriorConfig) -> Callable[[Int[Array, "b"]], PriorTerms]:
            return lambda r: _sample_batch(own, condition[r], [names[i] for i in r], steps, masks[r])

        made = map_in_single_threads([worker(own) for own in copies], parts)
        return _concatenate([part for _, part in zip(progress(parts, what), made, strict=True)])

    if not prior.staged or n <= FEW or prior.steps <= CHEAP:
        return sample_rows(np.arange(n), prior.steps, "sample poses"), np.full(n, prior.steps)
    found, full = staging.score_in_stages(
        n,
        lambda rows: sample_rows(rows, CHEAP, "sample poses"),
        lambda rows: sample_rows(rows, prior.steps, "sample best poses"),
    )
    share = (n * CHEAP + int(full.sum()) * prior.steps) / (n * prior.steps)
    _log.info("%d of %d poses were sampled in full: %.0f %% of the cost of all", full.sum(), n, 100 * share)
    return found, np.where(full, prior.steps, CHEAP)


def _copy_for_threads(prior: PriorConfig, batches: int) -> list[PriorConfig]:
    """The prior and copies of it, one for each thread that has a batch; alone where a copy would take much memory."""
    model = prior.model
    if not isinstance(model, CopyablePrior):
        return [prior]
    return [prior, *(replace(prior, model=model.copy()) for _ in range(min(default_threads(), batches) - 1))]


def _sample_batch(
    prior: PriorConfig, condition: Condition, names: list[str], steps: int, masks: Float32[Array, "k s s"]
) -> PriorTerms:
    latents = prior.model.sample(condition, prior.samples, prior.p_drop, steps, prior.seed)
    _, maps = w2_sq(latents, None, names)
    pictures = prior.model.decode(latents).rgba[..., :3]
    disagreement = single = None
    if prior.weights is not None:
        from dav_gswt.images import lpips  # not above: torch takes seconds to load, and most scoring does without

        disagreement = lpips.pairwise_mean((2 * pictures - 1) * masks[:, None, :, :, None], prior.weights)
        if prior.p_drop == 0:
            one, render = ((2 * p - 1) * masks[..., None] for p in (pictures[:, 0], condition.colour))
            single = lpips.distance(one, render, prior.weights)
    residual = ((latents.mean(1) - prior.model.encode_render(condition)) ** 2).sum(1)
    return PriorTerms(
        weighted_mean(maps, masks),
        disagreement,
        image_gradient(pictures, names=names),
        maps,
        single,
        weighted_mean(residual, masks),
    )


def weighted_mean(maps: Float32[Array, "n h w"], masks: Float32[Array, "n s s"]) -> Float64[Array, "n"]:
    """Mean of each map weighted by the share of counted pixels in a cell; 0 if there are none."""
    n, h, w = maps.shape
    cells = masks.reshape(n, h, masks.shape[1] // h, w, masks.shape[2] // w).mean((2, 4), dtype=np.float64)
    return (maps * cells).sum((1, 2)) / np.maximum(cells.sum((1, 2)), 1e-9)


def _concatenate(parts: list[PriorTerms]) -> PriorTerms:
    return PriorTerms(
        np.concatenate([part.w2_sq for part in parts]),
        _concatenate_known([part.lpips for part in parts]),
        np.concatenate([part.gradient for part in parts]),
        np.concatenate([part.maps for part in parts]),
        _concatenate_known([part.single for part in parts]),
        _concatenate_known([part.residual for part in parts]),
    )


def _concatenate_known(parts: list[Float64[Array, "_"] | None]) -> Float64[Array, "n"] | None:
    """Concatenate a term; None where the prior's settings leave it out, which they do for all parts or for none."""
    known = [part for part in parts if part is not None]
    assert len(known) in (0, len(parts))
    return np.concatenate(known) if known else None
