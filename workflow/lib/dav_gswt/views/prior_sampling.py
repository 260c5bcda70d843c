"""Samples of a prior at candidate poses, and the score terms that follow from them."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int
from numpy import ndarray as Array

from dav_gswt.files import locate_path
from dav_gswt.images.lpips_weights import Weights, read
from dav_gswt.logs import progress
from dav_gswt.prior.interface import Condition, CopyablePrior, Prior
from dav_gswt.threads import default_threads, map_in_single_threads
from dav_gswt.views import terms
from dav_gswt.views.uncertainty import robust_scale, w2_sq

_log = logging.getLogger(__name__)

BATCH = 4  # poses sampled at a time: as fast as more at once, and few enough that every thread has some
CHEAP = 2  # denoising steps of the first of two stages
TOP = 20  # poses whose order matters: as many as a round may take
STAGE = 16  # poses scored in full before it is decided whether more are needed
RATIO = 0.95  # quantile of full over cheap values that bounds the full values of other poses
FEW = 2 * (TOP + STAGE)  # up to so many poses a single stage costs less


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
    return PriorConfig(load_prior(entry), entry["samples"], entry["steps"], p_drop, seed, weights)


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


# by name the terms of poses, row by row, and `maps` of w2_sq, in cells of the latents
SampledTerms = dict[str, Array]


def sample_terms(
    prior: PriorConfig, condition: Condition, names: list[str], masks: Float32[Array, "n s s"]
) -> tuple[SampledTerms, Int[Array, "n"]]:
    """Compute the terms of every pose, and the denoising steps used for each.

    Many poses are scored in two stages (`score_in_stages`): all with CHEAP steps, then the best in full.
    masks: 1 for pixels that look at the modelled ground. w2_sq is the mean over these (0 if there are none), and LPIPS
    sees only these; maps and gradient are of the whole picture.
    Raises: ValueError: fewer than 2 samples, p_drop outside [0, 1), something not finite, naming the poses.
    """
    n, copies = len(condition), _copy_for_threads(prior, -(-len(condition) // BATCH))

    def sample_rows(rows: Int[Array, "k"], steps: int, what: str) -> SampledTerms:
        parts = [rows[i : i + BATCH] for i in range(0, len(rows), BATCH)]

        def worker(own: PriorConfig) -> Callable[[Int[Array, "b"]], SampledTerms]:
            return lambda r: _sample_batch(own, condition[r], [names[i] for i in r], steps, masks[r])

        made = map_in_single_threads([worker(own) for own in copies], parts)
        found = [part for _, part in zip(progress(parts, what), made, strict=True)]
        return {name: np.concatenate([part[name] for part in found]) for name in found[0]}

    if n <= FEW or prior.steps <= CHEAP:
        return sample_rows(np.arange(n), prior.steps, "sample poses"), np.full(n, prior.steps)
    found, full = score_in_stages(
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
) -> SampledTerms:
    latents = prior.model.sample(condition, prior.samples, prior.p_drop, steps, prior.seed)
    maps, pictures = w2_sq(latents, names=names)[1], prior.model.decode(latents).rgba[..., :3]
    render, plain = prior.model.encode_render(condition), prior.p_drop == 0
    drawn = terms.Samples(condition, names, latents, maps, pictures, render, masks, prior.weights, plain)
    return terms.compute_terms(drawn) | {"maps": maps}


def score_in_stages(
    n: int,
    cheap: Callable[[Int[Array, "k"]], SampledTerms],
    full: Callable[[Int[Array, "k"]], SampledTerms],
    top: int = TOP,
) -> tuple[SampledTerms, Bool[Array, "n"]]:
    """Score n poses in two stages. Returns the terms, and which poses were scored in full.

    Poses are scored in full in the order of their best cheap rank, by any term and by the terms' sum, until for each of
    these the `top` best full values exceed the bound of all remaining poses: their cheap value times the RATIO quantile
    of full over cheap. The remaining poses keep their cheap values times the median ratio.
    """
    first, done = cheap(np.arange(n)), np.zeros(n, bool)
    found = {name: values.copy() for name, values in first.items()}
    scales = {name: robust_scale(values) for name, values in first.items() if name != "maps"}
    before = _rankings(first, scales)
    order = np.argsort(np.min([np.argsort(np.argsort(-v, kind="stable")) for v in before.values()], 0), kind="stable")
    while len(rest := order[~done[order]]):
        if done.sum() >= top and not _may_enter_top(_rankings(found, scales), before, done, top):
            break
        rows = np.sort(rest[: STAGE if done.any() else top + STAGE])
        for name, values in full(rows).items():
            found[name][rows] = values
        done[rows] = True
    if not done.all():
        usual = {name: np.median(_ratios(found[name][done], first[name][done])) for name in scales}
        for name, values in first.items():
            ratio = usual[name] if name in usual else np.float32(usual["w2_sq"])
            found[name][~done] = ratio * values[~done]
    return found, done


def _rankings(found: SampledTerms, scales: dict[str, float]) -> dict[str, Float64[Array, "n"]]:
    """Values by which policies may rank poses; so does their sum."""
    named = {name: found[name] for name in scales if terms.TERMS[name].ranks}
    total = sum((values / (scales[name] or 1) for name, values in named.items()), np.zeros(len(found["maps"])))
    return named | {"sum": total}


def _may_enter_top(
    now: dict[str, Float64[Array, "n"]], before: dict[str, Float64[Array, "n"]], done: Bool[Array, "n"], top: int
) -> bool:
    """Whether a pose scored only cheaply may belong to the best `top` by any ranking."""
    for name, full in now.items():
        bound = before[name][~done] * np.quantile(_ratios(full[done], before[name][done]), RATIO)
        if (bound > np.sort(full[done])[-top]).any():
            return True
    return False


def _ratios(full: Float[Array, "k"], cheap: Float[Array, "k"]) -> Float64[Array, "_"]:
    there = cheap > 0
    return full[there] / cheap[there] if there.any() else np.ones(1)
