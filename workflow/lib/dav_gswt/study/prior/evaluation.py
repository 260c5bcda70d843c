"""Evaluation of the prior on held-out worlds: the accuracy of its pictures, and of its uncertainty.

It is compared with cheaper estimates: the render itself and its opacity. Accuracy is measured where the truth is
opaque. Uncertainty is evaluated by how it ranks views, and cells of the latent, by the true error of the render.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.images import lpips, metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.logs import progress
from dav_gswt.prior.networks import LATENT, SIZE
from dav_gswt.prior.terrain import TerrainPrior, pack_render, pack_truth
from dav_gswt.study.calibration.agreement import ause, spearman
from dav_gswt.study.prior.training.example_files import Examples
from dav_gswt.views.uncertainty import LUMINANCE, gradient_map, w2_sq

OPAQUE = 0.99  # opacity of the truth from which on a pixel counts
P_DROPS = 0.05, 0.1, 0.15, 0.2, 0.3
STEPS = 2, 4, 8, 16
BATCH = 32  # views that are sampled at a time: decoded samples take memory
SIDE = SIZE // LATENT[1]  # pixels of a cell
COVERED = 0.9  # opacity of the render from which on a cell is covered
RANKED = "", "ground_", "cell_", "covered_"
COLUMNS = "psnr", "lpips", *(f"{by}{how}" for by in RANKED for how in ("spearman", "ause")), "seconds"


@dataclass(frozen=True)
class Setting:
    """The default sampling. m: samples per view. steps: of denoising."""

    m: int = 5
    p_drop: float = 0.15
    steps: int = 8
    seed: int = 0


@dataclass(frozen=True)
class Estimate:
    """The result of one method for b views: pictures, or uncertainty as a map of the latent's cells or as one number.

    seconds: for all b views.
    """

    what: str
    setting: str
    seconds: float
    picture: Float32[Array, "b s s 3"] | None = None
    cells: Float32[Array, "b h w"] | None = None
    uncertainty: Float[Array, "b"] | None = None


@dataclass(frozen=True)
class Truth:
    """The reference of estimates.

    error, cell_error: root mean square error of the render over opaque pixels, per view and per cell (0 in cells
    without such pixels). share: of opaque pixels per cell. covered: opacity of the render per cell.
    """

    colour: Float32[Array, "n s s 3"]
    opaque: Bool[Array, "n s s"]
    error: Float[Array, "n"]
    cell_error: Float[Array, "n h w"]
    share: Float[Array, "n h w"]
    covered: Float[Array, "n h w"]

    def __getitem__(self, rows) -> "Truth":
        return Truth(*(getattr(self, f.name)[rows] for f in fields(self)))


def compute_truth(made: Examples) -> Truth:
    """Raises: ValueError: a view of which nothing is opaque (`evenly` passes over such)."""
    colour, seen = made.rgba[..., :3], opaque_mask(made)
    if not seen.any((1, 2)).all():
        raise ValueError(f"nothing of view {int(np.argmin(seen.any((1, 2))))} is opaque: there is no error to rank by")
    squares = ((made.condition.colour - colour).astype(float) ** 2).mean(-1) * seen
    share = average_cells(seen.astype(float))
    error = np.sqrt(squares.sum((1, 2)) / seen.sum((1, 2)))
    cell_error = np.sqrt(average_cells(squares) / np.maximum(share, 1 / SIDE**2))
    return Truth(colour, seen, error, cell_error, share, average_cells(made.condition.alpha))


def opaque_mask(made: Examples) -> Bool[Array, "n s s"]:
    """Pixels where the truth is opaque."""
    return made.rgba[..., 3] >= OPAQUE


def average_cells(image: Float[Array, "n s s"]) -> Float[Array, "n h w"]:
    """Means over the pixels of each of the code's cells."""
    n, s, _ = image.shape
    return image.reshape(n, s // SIDE, SIDE, s // SIDE, SIDE).mean((2, 4))


def select_evenly(made: Examples, count: int) -> Examples:
    """At most `count` of the examples with opaque pixels, evenly from first to last."""
    usable = np.flatnonzero(opaque_mask(made).any((1, 2)))
    return made[usable[np.linspace(0, len(usable) - 1, min(count, len(usable))).round().astype(int)]]


def evaluate_prior(
    made: Examples,
    prior: TerrainPrior,
    setting: Setting | None = None,
    weights: Weights | None = None,
) -> list[dict]:
    """Rows of what, setting and COLUMNS; None where a column does not apply.

    psnr (dB) and lpips: mean over views. spearman, ause: of the mean uncertainty of a picture against the error of its
    render; ground_: of the mean over the cells where the truth is opaque; cell_: of the cells of all views; covered_:
    of the cells that the render covers, where opacity says little. seconds: per view.
    weights: of LPIPS.
    Raises: ValueError: no view; see `compute_truth`, `TerrainPrior.sample`.
    """
    setting = setting or Setting()
    if not len(made):
        raise ValueError("there is no view to evaluate the prior on")
    if setting.m < 2:
        raise ValueError(f"m is {setting.m}: a spread takes at least 2 samples")
    truth = compute_truth(made)
    parts: dict[tuple[str, str], list[dict[str, Array]]] = {}
    for start in progress(range(0, len(made), BATCH), "evaluate prior"):
        rows = slice(start, start + BATCH)
        for estimate in make_estimates(made[rows], prior, setting, weights):
            scores = score_estimate(estimate, truth[rows], weights)
            parts.setdefault((estimate.what, estimate.setting), []).append(scores)
    return [
        {"what": what, "setting": how}
        | summarize_scores({name: np.concatenate([p[name] for p in got]) for name in got[0]}, truth)
        for (what, how), got in parts.items()
    ]


def make_estimates(
    made: Examples, prior: TerrainPrior, setting: Setting, weights: Weights | None
) -> Iterator[Estimate]:
    """The estimates of all methods, in the order of the table."""
    yield Estimate("render", "", 0.0, picture=made.condition.colour)
    yield Estimate("opacity", "", 0.0, cells=average_cells(1 - made.condition.alpha))
    code, seconds = measure_time(_encode_truth, made, prior)
    picture, more = measure_time(decode_colours, prior, code)
    yield Estimate("coder", "", seconds + more, picture=picture)
    yield from _estimate_from_noises(made, prior, setting)
    yield from _estimate_from_dropout(made, prior, setting, weights)


def _encode_truth(made: Examples, prior: TerrainPrior) -> Float32[Array, "b c h w"]:
    return prior.encode(pack_truth(made.rgba, made.inverse_depth)).numpy()


def _estimate_from_noises(made: Examples, prior: TerrainPrior, setting: Setting) -> Iterator[Estimate]:
    """Without dropout: one sample, and the disagreement of samples from other noises."""
    for steps in sorted({*STEPS, setting.steps}):
        latents, seconds = measure_time(prior.sample, made.condition, 1, 0.0, steps, setting.seed)
        picture, more = measure_time(decode_colours, prior, latents[:, 0])
        yield Estimate("sample", f"steps={steps}", seconds + more, picture=picture)
    how = f"m={setting.m} noises steps={setting.steps}"
    asked = setting.m, 0.0, setting.steps, setting.seed
    latents, seconds = measure_time(prior.sample, made.condition, *asked, common=False)
    mean, more = measure_time(lambda: decode_colours(prior, latents).mean(1))
    yield Estimate("mean of samples", how, seconds + more, picture=mean)
    yield Estimate("spread", how, seconds, cells=w2_sq(latents)[1])
    yield Estimate("residual of samples", how, seconds, cells=compute_residual(prior, made, latents.mean(1)))


def _estimate_from_dropout(
    made: Examples, prior: TerrainPrior, setting: Setting, weights: Weights | None
) -> Iterator[Estimate]:
    """With one noise: the disagreement of samples under other dropout masks, by dropout rate and by steps."""
    middle = setting.p_drop, setting.steps
    around = [(p, setting.steps) for p in P_DROPS] + [(setting.p_drop, n) for n in STEPS]
    for p_drop, steps in sorted({middle, *around}):
        how = f"m={setting.m} p_drop={p_drop} steps={steps}"
        latents, seconds = measure_time(prior.sample, made.condition, setting.m, p_drop, steps, setting.seed)
        yield Estimate("w2_sq", how, seconds, cells=w2_sq(latents)[1])
        if (p_drop, steps) == middle:
            decoded, more = measure_time(decode_colours, prior, latents)
            yield from _estimate_from_pictures(decoded, how, seconds + more, weights)


def _estimate_from_pictures(
    decoded: Float32[Array, "b m s s 3"], how: str, seconds: float, weights: Weights | None
) -> Iterator[Estimate]:
    mean = decoded.mean(1)
    yield Estimate("mean of samples", how, seconds, picture=mean)
    slope = gradient_map(mean.astype(float) @ np.array(LUMINANCE))
    yield Estimate("gradient", how, seconds, cells=average_cells(slope).astype(np.float32))
    if weights is not None:
        apart, more = measure_time(lpips.pairwise_mean, 2 * decoded - 1, weights)
        yield Estimate("lpips", how, seconds + more, uncertainty=apart)


def measure_time(function: Callable, *given, **named):
    """The result of a function, and the seconds that it took."""
    begun = time.perf_counter()
    value = function(*given, **named)
    return value, time.perf_counter() - begun


def decode_colours(learned: TerrainPrior, latents: Float32[Array, "*n c h w"]) -> Float32[Array, "*n s s 3"]:
    """Colours over black of latents."""
    return np.ascontiguousarray(learned.decode(latents).rgba[..., :3])


def compute_residual(learned: TerrainPrior, made: Examples, code: Float32[Array, "b c h w"]) -> Float32[Array, "b h w"]:
    """Mean squared difference between a latent of the view and that of the render, per cell."""
    return ((code - learned.encode(pack_render(made.condition)).numpy()) ** 2).mean(1)


def score_estimate(estimate: Estimate, truth: Truth, weights: Weights | None) -> dict[str, Array]:
    """The scores of an estimate, or the values to be ranked by the error: one array over views each."""
    out = {"seconds": np.full(len(truth.error), estimate.seconds / len(truth.error))}
    if estimate.picture is not None:
        out["psnr"] = masked_psnr(estimate.picture, truth)
        if weights is not None:
            compared = np.where(truth.opaque[..., None], estimate.picture, truth.colour)
            out["lpips"] = lpips.distance(2 * compared - 1, 2 * truth.colour - 1, weights)
    if estimate.uncertainty is not None:
        out["uncertainty"] = estimate.uncertainty
    if estimate.cells is not None:
        cells = estimate.cells.astype(float)
        out |= {"cells": cells, "uncertainty": cells.mean((1, 2))}
        out["ground"] = (cells * truth.share).sum((1, 2)) / truth.share.sum((1, 2))
    return out


def masked_psnr(picture: Float32[Array, "b s s 3"], truth: Truth) -> Float[Array, "b"]:
    """Over opaque pixels; NaN where the picture is the truth."""
    views = zip(picture, truth.colour, truth.opaque.astype(float), strict=True)
    return np.array([np.nan if (value := metrics.psnr(*view)) is None else value for view in views])


def summarize_scores(got: dict[str, Array], truth: Truth) -> dict[str, float | None]:
    """COLUMNS of the scores of all views."""
    row: dict[str, float | None] = dict.fromkeys(COLUMNS)
    row["seconds"] = float(got["seconds"].mean())
    for name in ("psnr", "lpips"):
        if name in got and np.isfinite(got[name]).any():
            row[name] = float(np.nanmean(got[name]))
    ranked = {"": (got.get("uncertainty"), truth.error), "ground_": (got.get("ground"), truth.error)}
    if "cells" in got:
        seen = truth.share > 0
        for by, counted in {"cell_": seen, "covered_": seen & (truth.covered >= COVERED)}.items():
            ranked[by] = got["cells"][counted], truth.cell_error[counted]
    for by, (values, error) in ranked.items():
        if values is not None and len(values):
            row[f"{by}spearman"], row[f"{by}ause"] = spearman(values, error), ause(values, error)
    return row
