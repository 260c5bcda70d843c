"""Two-stage scoring: all poses cheaply, then in full those that may be among the best."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int
from numpy import ndarray as Array

from dav_gswt.views.uncertainty.weighting import robust_scale

TOP = 20  # poses whose order matters: as many as a round may take
BATCH = 16  # poses scored in full at a time
RATIO = 0.95  # quantile of full over cheap values that bounds the full values of other poses
RANKING = ("w2_sq", "lpips", "single")  # terms by which policies rank; so does their sum


@dataclass(frozen=True)
class PriorTerms:
    """Terms of n poses. lpips: None without its weights. single: LPIPS between the only sample without dropout and the
    render; None with dropout. maps: of w2_sq, in cells of the latents. residual: squared distance of the samples' mean
    from the latents of the render."""

    w2_sq: Float64[Array, "n"]
    lpips: Float64[Array, "n"] | None
    gradient: Float64[Array, "n"]
    maps: Float32[Array, "n h w"]
    single: Float64[Array, "n"] | None = None
    residual: Float64[Array, "n"] | None = None

    def by_name(self) -> dict[str, Float64[Array, "n"]]:
        """The available terms by name."""
        found = {"w2_sq": self.w2_sq, "lpips": self.lpips, "gradient": self.gradient}
        found |= {"single": self.single, "residual": self.residual}
        return {name: values for name, values in found.items() if values is not None}


def score_in_stages(
    n: int,
    cheap: Callable[[Int[Array, "k"]], PriorTerms],
    full: Callable[[Int[Array, "k"]], PriorTerms],
    top: int = TOP,
) -> tuple[PriorTerms, Bool[Array, "n"]]:
    """Score n poses in two stages. Returns the terms, and which poses were scored in full.

    Poses are scored in full in the order of their best cheap rank, by any term and by the terms' sum, until for each of
    these the `top` best full values exceed the bound of all remaining poses: their cheap value times the RATIO quantile
    of full over cheap. The remaining poses keep their cheap values times the median ratio.
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
    """Values by which poses may be ranked."""
    named = {name: values for name, values in terms.by_name().items() if name in RANKING}
    total = np.zeros(len(terms.w2_sq))
    for name, values in named.items():
        total += values / (scales[name] or 1)
    return named | {"sum": total}


def _scales(terms: PriorTerms) -> dict[str, float]:
    return {name: robust_scale(values) for name, values in terms.by_name().items()}


def _best_rank(terms: PriorTerms) -> Int[Array, "n"]:
    ranks = [np.argsort(np.argsort(-v, kind="stable")) for v in _rankings(terms, _scales(terms)).values()]
    return np.min(ranks, axis=0)


def _may_enter_top(found: PriorTerms, first: PriorTerms, done: Bool[Array, "n"], top: int) -> bool:
    """Whether a pose scored only cheaply may belong to the best `top` by any ranking."""
    scales = _scales(first)
    now, before = _rankings(found, scales), _rankings(first, scales)
    for name, full in now.items():
        ratio = _ratios(full[done], before[name][done])
        bar = np.sort(full[done])[-top]
        if (before[name][~done] * np.quantile(ratio, RATIO) > bar).any():
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
    """Scale cheap values by the median ratio of full over cheap."""
    if done.all() or not done.any():
        return found
    parts = {}
    for name, cheap in first.by_name().items():
        usual = float(np.median(_ratios(getattr(found, name)[done], cheap[done])))
        parts[name] = np.where(done, getattr(found, name), usual * cheap)
        if name == "w2_sq":
            parts["maps"] = np.where(done[:, None, None], found.maps, np.float32(usual) * first.maps)
    return replace(found, **parts)
