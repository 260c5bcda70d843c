"""What a policy is worth: the area under its curve of PSNR against photos, and paired comparisons with intervals.

The unit is (scene, seed): all policies start from the same photos and fields, and are paired there.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

DRAWS = 10_000  # of the bootstrap
WAY = 0.95  # of the way from the start to all photos
TIE = 0.05  # dB: less than what another run of the same fit differs by


@dataclass(frozen=True)
class Compared:
    """A policy less another, in dB of nAUC: mean, the ends of its interval, a two-sided p value, and over how many
    units it wins, ties (within `TIE`) and loses."""

    mean: float
    low: float
    high: float
    p: float
    wins: int
    ties: int
    losses: int


def nauc(photos: Float[Array, "t"], psnr: Float[Array, "t"]) -> float:
    """Normalised area under PSNR against photos: its mean over the budget, by the trapezoidal rule, in dB.

    photos: rising, from the start to the budget. Raises: ValueError: fewer than two rounds, photos that do not rise, a
    value that is not finite. Source: nAUC = trapezoid(PSNR, n_0..B) / (B - n_0).
    """
    if len(photos) < 2:
        raise ValueError(f"a curve needs at least two rounds, not {len(photos)}")
    if not (np.diff(photos) > 0).all() or not np.isfinite(psnr).all():
        raise ValueError("a curve's photos must rise from round to round, and its values be finite")
    return float(np.trapezoid(psnr, photos) / (photos[-1] - photos[0]))


def to_reach(photos: Float[Array, "t"], psnr: Float[Array, "t"], best: float, way: float = WAY) -> float | None:
    """Photos until PSNR is `way` of the way from the start to `best`, linear between rounds; None if it never is."""
    goal = psnr[0] + way * (best - psnr[0])
    for t in range(len(photos)):
        if psnr[t] >= goal:
            if t == 0:
                return float(photos[0])
            share = (goal - psnr[t - 1]) / (psnr[t] - psnr[t - 1])
            return float(photos[t - 1] + share * (photos[t] - photos[t - 1]))
    return None


def compared(differences: dict[str, Float[Array, "_"]], seed: int, level: float = 0.95) -> Compared:
    """Paired differences of units, by scene; the bootstrap draws scenes, then seeds within each.

    One scene alone is drawn as it is: the interval is then of its seeds, and says nothing of other scenes. p: twice the
    share of draws on the other side of 0, never less than one draw.
    Raises: ValueError: no difference, or one that is not finite.
    """
    scenes = [values for values in differences.values() if len(values)]
    everything = np.concatenate(scenes) if scenes else np.zeros(0)
    if not len(everything) or not np.isfinite(everything).all():
        raise ValueError("a comparison needs differences, all of them finite")
    rng, means = np.random.default_rng(seed), np.empty(DRAWS)
    for i in range(DRAWS):
        drawn = (scenes[j] for j in rng.integers(len(scenes), size=len(scenes)))
        means[i] = np.mean([np.mean(values[rng.integers(len(values), size=len(values))]) for values in drawn])
    low, high = np.quantile(means, [(1 - level) / 2, (1 + level) / 2])
    beyond = min((means <= 0).mean(), (means >= 0).mean())
    wins, losses = int((everything > TIE).sum()), int((everything < -TIE).sum())
    mean = float(np.mean([values.mean() for values in scenes]))
    p = float(min(1.0, 2 * max(beyond, 1 / DRAWS)))
    return Compared(mean, float(low), float(high), p, wins, len(everything) - wins - losses, losses)


def holm(p: dict[str, float]) -> dict[str, float]:
    """p values of several comparisons, raised so that one false alarm among all is as unlikely as they say (Holm)."""
    out, most = {}, 0.0
    for i, (name, value) in enumerate(sorted(p.items(), key=lambda item: item[1])):
        most = max(most, min(1.0, (len(p) - i) * value))
        out[name] = most
    return out
