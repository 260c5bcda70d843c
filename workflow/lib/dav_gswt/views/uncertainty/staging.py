"""Scoring in two stages: every pose cheaply, then in full those that may be among the best, until the rest cannot."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int
from numpy import ndarray as Array

from dav_gswt.views.uncertainty.weighting import robust_scale

TOP = 20  # poses whose order matters: as many as a round may take
BATCH = 16  # poses scored in full before looking again
REACH = 0.95  # quantile of full over cheap, of the poses scored both ways: more is not expected of the others
RANKING = ("w2_sq", "lpips", "single", "residual")  # terms by which policies rank; and their sum


@dataclass(frozen=True)
class PriorTerms:
    """Of n poses. lpips: None without its weights. single: LPIPS between the one sample that there is without dropout
    and the render itself; None with dropout. maps: of w2_sq, in cells of the latents. residual: squared distance of the
    samples' mean from the latents of the render itself."""

    w2_sq: Float64[Array, "n"]
    lpips: Float64[Array, "n"] | None
    gradient: Float64[Array, "n"]
    maps: Float32[Array, "n h w"]
    single: Float64[Array, "n"] | None = None
    residual: Float64[Array, "n"] | None = None

    def named(self) -> dict[str, Float64[Array, "n"]]:
        """The terms that there are, by name."""
        found = {"w2_sq": self.w2_sq, "lpips": self.lpips, "gradient": self.gradient}
        found |= {"single": self.single, "residual": self.residual}
        return {name: values for name, values in found.items() if values is not None}


def score_in_stages(
    n: int,
    cheap: Callable[[Int[Array, "k"]], PriorTerms],
    full: Callable[[Int[Array, "k"]], PriorTerms],
    top: int = TOP,
) -> tuple[PriorTerms, Bool[Array, "n"]]:
    """Terms of all n poses, and which of them were scored in full.

    Poses go on to full scoring in the order of their best cheap rank, by any term and by the terms' sum, until for
    each of these the `top` best full values are above all that the remaining poses can be expected to reach: their
    cheap value times nearly the largest ratio seen. Those keep their cheap values, times the usual ratio.
    """
    found, done = cheap(np.arange(n)), np.zeros(n, bool)
    first = found
    order = np.argsort(_best_rank(found), kind="stable")
    while len(rest := order[~done[order]]):
        if done.sum() >= top and not _may_enter_top(found, first, done, top):
            break
        rows = np.sort(rest[: BATCH if done.any() else top + BATCH])
        found, done = _insert_rows(found, rows, full(rows)), done.copy()
        done[rows] = True
    return _rescale_cheap(found, first, done), done


def _rankings(terms: PriorTerms, scales: dict[str, float]) -> dict[str, Float64[Array, "n"]]:
    """What poses may be ranked by."""
    named = {name: values for name, values in terms.named().items() if name in RANKING}
    total = np.zeros(len(terms.w2_sq))
    for name, values in named.items():
        total += values / (scales[name] or 1)
    return named | {"sum": total}


def _scales(terms: PriorTerms) -> dict[str, float]:
    return {name: robust_scale(values) for name, values in terms.named().items()}


def _best_rank(terms: PriorTerms) -> Int[Array, "n"]:
    ranks = [np.argsort(np.argsort(-v, kind="stable")) for v in _rankings(terms, _scales(terms)).values()]
    return np.min(ranks, axis=0)


def _may_enter_top(found: PriorTerms, first: PriorTerms, done: Bool[Array, "n"], top: int) -> bool:
    """Whether a pose that was scored cheaply alone may belong to the best `top` by any ranking."""
    scales = _scales(first)
    now, before = _rankings(found, scales), _rankings(first, scales)
    for name, full in now.items():
        ratio = _ratios(full[done], before[name][done])
        bar = np.sort(full[done])[-top]
        if (before[name][~done] * np.quantile(ratio, REACH) > bar).any():
            return True
    return False


def _ratios(full: Float[Array, "k"], cheap: Float[Array, "k"]) -> Float64[Array, "_"]:
    there = cheap > 0
    return full[there] / cheap[there] if there.any() else np.ones(1)


def _insert_rows(into: PriorTerms, rows: Int[Array, "k"], values: PriorTerms) -> PriorTerms:
    parts = {}
    for name, new in vars(values).items():
        if new is not None:
            parts[name] = getattr(into, name).copy()
            parts[name][rows] = new
    return replace(into, **parts)


def _rescale_cheap(found: PriorTerms, first: PriorTerms, done: Bool[Array, "n"]) -> PriorTerms:
    """Cheap values brought to the full ones' level: few steps disagree by another amount than many."""
    if done.all() or not done.any():
        return found
    parts = {}
    for name, cheap in first.named().items():
        usual = float(np.median(_ratios(getattr(found, name)[done], cheap[done])))
        parts[name] = np.where(done, getattr(found, name), usual * cheap)
        if name == "w2_sq":
            parts["maps"] = np.where(done[:, None, None], found.maps, np.float32(usual) * first.maps)
    return replace(found, **parts)
