"""The prior on worlds that it was not trained on: how near it comes to the truth, and what its doubt is worth.

Beside it stand what costs less: the field as it is, its opacity, and deterministic regressors of the prior's shape.
What is near the truth is measured where the truth is opaque, since the sky is nobody's to know; what doubt is worth is
how it ranks views, and cells of the code, by the true error of the render. Nothing is assumed: poor is written too.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import lpips, metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.logs import progress
from dav_gswt.prior.networks import LATENT, SIZE
from dav_gswt.prior.terrain import LatentModel, TerrainPrior, pack_render, pack_truth
from dav_gswt.prior.training.example_files import Examples
from dav_gswt.study.prior.regressor import Regressor
from dav_gswt.views.uncertainty import ause, gradient_map, spearman, w2_sq
from dav_gswt.views.uncertainty.texture import LUMINANCE

OPAQUE = 0.99  # opacity of the truth from which on a pixel counts
P_DROPS = 0.05, 0.1, 0.15, 0.2, 0.3
STEPS = 2, 4, 8, 16
AT_ONCE = 32  # views that are imagined at a time: decoded samples take memory
SIDE = SIZE // LATENT[1]  # pixels of a cell
COVERED = 0.9  # opacity of the render from which on a cell is covered
RANKED = "", "ground_", "cell_", "covered_"
COLUMNS = "psnr", "lpips", *(f"{by}{how}" for by in RANKED for how in ("spearman", "ause")), "seconds"


@dataclass(frozen=True)
class Setting:
    """How the prior is asked where a row does not say otherwise. m: samples of a view; steps: of denoising."""

    m: int = 5
    p_drop: float = 0.15
    steps: int = 8
    seed: int = 0


@dataclass(frozen=True)
class Guess:
    """What one method makes of b views: their picture, or how doubtful they are, by a map of the code's cells or at
    least by a number each. seconds: of all b, from what is given to what is guessed."""

    what: str
    setting: str
    seconds: float
    picture: Float32[Array, "b s s 3"] | None = None
    cells: Float32[Array, "b h w"] | None = None
    doubt: Float[Array, "b"] | None = None


@dataclass(frozen=True)
class Truth:
    """What guesses are compared with. error: of the render, root mean square over opaque pixels and colours, of each
    view and cell (0 in cells without such pixels); share: of a cell's pixels that are opaque; covered: by the render,
    in each cell."""

    colour: Float32[Array, "n s s 3"]
    opaque: Bool[Array, "n s s"]
    error: Float[Array, "n"]
    cell_error: Float[Array, "n h w"]
    share: Float[Array, "n h w"]
    covered: Float[Array, "n h w"]

    def __getitem__(self, rows) -> "Truth":
        return Truth(*(getattr(self, f.name)[rows] for f in fields(self)))


def truth_of(made: Examples) -> Truth:
    """Raises: ValueError: a view of which nothing is opaque (`evenly` passes over such)."""
    colour, seen = made.rgba[..., :3], opaque(made)
    if not seen.any((1, 2)).all():
        raise ValueError(f"nothing of view {int(np.argmin(seen.any((1, 2))))} is opaque: there is no error to rank by")
    squares = ((made.condition.colour - colour).astype(float) ** 2).mean(-1) * seen
    share = in_cells(seen.astype(float))
    error = np.sqrt(squares.sum((1, 2)) / seen.sum((1, 2)))
    cell_error = np.sqrt(in_cells(squares) / np.maximum(share, 1 / SIDE**2))
    return Truth(colour, seen, error, cell_error, share, in_cells(made.condition.alpha))


def opaque(made: Examples) -> Bool[Array, "n s s"]:
    """Pixels where the truth is opaque."""
    return made.rgba[..., 3] >= OPAQUE


def in_cells(image: Float[Array, "n s s"]) -> Float[Array, "n h w"]:
    """Means over the pixels of each of the code's cells."""
    n, s, _ = image.shape
    return image.reshape(n, s // SIDE, SIDE, s // SIDE, SIDE).mean((2, 4))


def chosen(made: Examples, rows) -> Examples:
    """Some of the examples."""
    return Examples(made.condition[rows], made.rgba[rows], made.inverse_depth[rows])


def evenly(made: Examples, count: int) -> Examples:
    """At most so many of the examples of which a part is opaque, evenly from first to last."""
    usable = np.flatnonzero(opaque(made).any((1, 2)))
    return chosen(made, usable[np.linspace(0, len(usable) - 1, min(count, len(usable))).round().astype(int)])


def tried(
    made: Examples,
    prior: TerrainPrior,
    regressors: Sequence[Regressor] = (),
    setting: Setting | None = None,
    weights: Weights | None = None,
) -> list[dict]:
    """Rows of what, setting and COLUMNS; None where a column does not apply, or cannot be said.

    psnr (dB) and lpips: mean over views. spearman, ause: of the doubt's mean over the picture against the render's
    error; ground_: of its mean over the cells where the truth is opaque, as poses are scored by what they see of the
    ground; cell_: of cells, all views together; covered_: of cells that the render covers, where opacity has little to
    say. seconds: of a view.
    weights: of LPIPS. Raises: ValueError: no view; see `truth_of`, `TerrainPrior.sample`. InputError: a regressor with
    another coder than the prior's, by its number.
    """
    setting = setting or Setting()
    _require_one_coder(prior, regressors)
    if not len(made):
        raise ValueError("no view is there to try the prior on")
    truth = truth_of(made)
    parts: dict[tuple[str, str], list[dict[str, Array]]] = {}
    for start in progress(range(0, len(made), AT_ONCE), "try prior"):
        rows = slice(start, start + AT_ONCE)
        for guess in guesses(chosen(made, rows), prior, regressors, setting, weights):
            parts.setdefault((guess.what, guess.setting), []).append(judged(guess, truth[rows], weights))
    return [
        {"what": what, "setting": how}
        | summed({name: np.concatenate([p[name] for p in got]) for name in got[0]}, truth)
        for (what, how), got in parts.items()
    ]


def _require_one_coder(prior: TerrainPrior, regressors: Sequence[Regressor]) -> None:
    for i, regressor in enumerate(regressors):
        both = ([*n.autoencoder.parameters(), n.scale] for n in (prior.network, regressor.network))
        if not all(torch.equal(a, b) for a, b in zip(*both, strict=True)):
            raise InputError(f"regressor {i} has another coder than the prior: train it on the prior's codes")


def guesses(
    made: Examples, prior: TerrainPrior, regressors: Sequence[Regressor], setting: Setting, weights: Weights | None
) -> Iterator[Guess]:
    """What all methods make of the views, in the order of the table."""
    yield Guess("render", "", 0.0, picture=made.condition.colour)
    yield Guess("opacity", "", 0.0, cells=in_cells(1 - made.condition.alpha))
    code, seconds = timed(_code_of_truth, made, prior)
    picture, more = timed(pictures, prior, code)
    yield Guess("coder", "", seconds + more, picture=picture)
    yield from _of_noises(made, prior, setting)
    yield from _of_dropout(made, prior, setting, weights)
    yield from _of_regressors(made, regressors, setting)


def _code_of_truth(made: Examples, prior: TerrainPrior) -> Float32[Array, "b c h w"]:
    return prior.encode(pack_truth(made.rgba, made.inverse_depth)).numpy()


def _of_noises(made: Examples, prior: TerrainPrior, setting: Setting) -> Iterator[Guess]:
    """No dropout: one sample, and how far samples from other noises lie from each other."""
    for steps in sorted({*STEPS, setting.steps}):
        latents, seconds = timed(prior.sample, made.condition, 1, 0.0, steps, setting.seed)
        picture, more = timed(pictures, prior, latents[:, 0])
        yield Guess("sample", f"steps={steps}", seconds + more, picture=picture)
    how = f"m={setting.m} noises steps={setting.steps}"
    asked = setting.m, 0.0, setting.steps, setting.seed
    latents, seconds = timed(prior.sample, made.condition, *asked, common=False)
    mean, more = timed(lambda: pictures(prior, latents).mean(1))
    yield Guess("mean of samples", how, seconds + more, picture=mean)
    yield Guess("spread", how, seconds, cells=w2_sq(latents)[1])
    yield Guess("residual of samples", how, seconds, cells=residual(prior, made, latents.mean(1)))


def _of_dropout(made: Examples, prior: TerrainPrior, setting: Setting, weights: Weights | None) -> Iterator[Guess]:
    """One noise: how far samples under other dropout masks lie from each other, over the shares and over the steps."""
    middle = setting.p_drop, setting.steps
    around = [(p, setting.steps) for p in P_DROPS] + [(setting.p_drop, n) for n in STEPS]
    for p_drop, steps in sorted({middle, *around}):
        how = f"m={setting.m} p_drop={p_drop} steps={steps}"
        latents, seconds = timed(prior.sample, made.condition, setting.m, p_drop, steps, setting.seed)
        yield Guess("w2_sq", how, seconds, cells=w2_sq(latents)[1])
        if (p_drop, steps) == middle:
            decoded, more = timed(pictures, prior, latents)
            yield from _of_pictures(decoded, how, seconds + more, weights)


def _of_pictures(
    decoded: Float32[Array, "b m s s 3"], how: str, seconds: float, weights: Weights | None
) -> Iterator[Guess]:
    mean = decoded.mean(1)
    yield Guess("mean of samples", how, seconds, picture=mean)
    slope = gradient_map(mean.astype(float) @ np.array(LUMINANCE))
    yield Guess("gradient", how, seconds, cells=in_cells(slope).astype(np.float32))
    if weights is not None:
        apart, more = timed(lpips.pairwise_mean, 2 * decoded - 1, weights)
        yield Guess("lpips", how, seconds + more, doubt=apart)


def _of_regressors(made: Examples, regressors: Sequence[Regressor], setting: Setting) -> Iterator[Guess]:
    codes, shown, total, drawn = [], [], 0.0, 0.0
    for i, regressor in enumerate(regressors):
        code, seconds = timed(regressor.predict, made.condition)
        picture, more = timed(pictures, regressor, code)
        yield Guess("regressor", f"member={i}", seconds + more, picture=picture)
        yield Guess("residual of regressor", f"member={i}", seconds, cells=residual(regressor, made, code))
        codes.append(code)
        shown.append(picture)
        total, drawn = total + seconds, drawn + more
    for p_drop in P_DROPS if regressors else ():
        latents, seconds = timed(regressors[0].sample, made.condition, setting.m, p_drop, setting.seed)
        yield Guess("dropout of regressor", f"m={setting.m} p_drop={p_drop}", seconds, cells=w2_sq(latents)[1])
    if len(regressors) > 1:
        how = f"members={len(regressors)}"
        yield Guess("mean of regressors", how, total + drawn, picture=np.mean(shown, 0))
        yield Guess("ensemble", how, total, cells=w2_sq(np.stack(codes, 1))[1])


def timed(function: Callable, *given, **named):
    """What a function returns, and the seconds that it took."""
    begun = time.perf_counter()
    value = function(*given, **named)
    return value, time.perf_counter() - begun


def pictures(learned: LatentModel, latents: Float32[Array, "*n c h w"]) -> Float32[Array, "*n s s 3"]:
    """Colours of latents, over black as the truth's."""
    return np.ascontiguousarray(learned.decode(latents).rgba[..., :3])


def residual(learned: LatentModel, made: Examples, code: Float32[Array, "b c h w"]) -> Float32[Array, "b h w"]:
    """Mean squared difference between a code of the view and that of the render as it is: by how much the field would
    have to change."""
    return ((code - learned.encode(pack_render(made.condition)).numpy()) ** 2).mean(1)


def judged(guess: Guess, truth: Truth, weights: Weights | None) -> dict[str, Array]:
    """What a guess is worth, or what will be ranked by the error: an array over views each."""
    out = {"seconds": np.full(len(truth.error), guess.seconds / len(truth.error))}
    if guess.picture is not None:
        out["psnr"] = psnr(guess.picture, truth)
        if weights is not None:
            compared = np.where(truth.opaque[..., None], guess.picture, truth.colour)
            out["lpips"] = lpips.distance(2 * compared - 1, 2 * truth.colour - 1, weights)
    if guess.doubt is not None:
        out["doubt"] = guess.doubt
    if guess.cells is not None:
        cells = guess.cells.astype(float)
        out |= {"cells": cells, "doubt": cells.mean((1, 2))}
        out["ground"] = (cells * truth.share).sum((1, 2)) / truth.share.sum((1, 2))
    return out


def psnr(picture: Float32[Array, "b s s 3"], truth: Truth) -> Float[Array, "b"]:
    """Over opaque pixels; NaN where the picture is the truth."""
    views = zip(picture, truth.colour, truth.opaque.astype(float), strict=True)
    return np.array([np.nan if (value := metrics.psnr(*view)) is None else value for view in views])


def summed(got: dict[str, Array], truth: Truth) -> dict[str, float | None]:
    """COLUMNS of what `judged` found of all views."""
    row: dict[str, float | None] = dict.fromkeys(COLUMNS)
    row["seconds"] = float(got["seconds"].mean())
    for name in ("psnr", "lpips"):
        if name in got and np.isfinite(got[name]).any():
            row[name] = float(np.nanmean(got[name]))
    ranked = {"": (got.get("doubt"), truth.error), "ground_": (got.get("ground"), truth.error)}
    if "cells" in got:
        seen = truth.share > 0
        for by, counted in {"cell_": seen, "covered_": seen & (truth.covered >= COVERED)}.items():
            ranked[by] = got["cells"][counted], truth.cell_error[counted]
    for by, (doubt, error) in ranked.items():
        if doubt is not None and len(doubt):
            row[f"{by}spearman"], row[f"{by}ause"] = spearman(doubt, error), ause(doubt, error)
    return row
