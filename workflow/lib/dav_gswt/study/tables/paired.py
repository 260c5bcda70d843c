"""Paired differences of one variant and another, with as many degrees of freedom as there are."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.stats import t as student

from dav_gswt.study.comparison.stats import compared

BOOTSTRAP = 0  # its seed


@dataclass(frozen=True)
class Paired:
    """mean: of the differences, over scenes; low, high: its 95 % bootstrap interval, over scenes, then seeds. t, df, p:
    of the paired t-test, two-sided; d: the mean over the deviation within scenes. None where nothing is known."""

    units: int
    mean: float
    low: float | None
    high: float | None
    t: float | None
    df: int
    p: float | None
    d: float | None


def paired(differences: dict[str, Float[Array, "_"]]) -> Paired:
    """Differences of pairs (one a seed), by scene.

    Scenes are what was looked at, seeds are drawn: with n pairs in S scenes the deviation s within scenes has n - S
    degrees of freedom, the mean m of the scenes' means the variance s^2 / S^2 sum(1 / n_s), and t = m / sqrt of that.
    Of one scene this is the usual paired test with n - 1. It tells of other seeds of these scenes, not of other scenes.
    One pair a scene has df 0, pairs that are all alike no deviation: then t, p and d are None.
    Raises: ValueError: no difference, or one that is not finite.
    """
    boot = compared(differences, BOOTSTRAP)
    groups = [values for values in differences.values() if len(values)]
    units, scenes = sum(map(len, groups)), len(groups)
    df = units - scenes
    squares = sum(float(((values - values.mean()) ** 2).sum()) for values in groups)
    low, high = (boot.low, boot.high) if units > 1 else (None, None)
    if df == 0 or squares == 0:
        return Paired(units, boot.mean, low, high, None, df, None, None)
    deviation = float(np.sqrt(squares / df))
    t = boot.mean / (deviation * float(np.sqrt(sum(1 / len(values) for values in groups))) / scenes)
    return Paired(units, boot.mean, low, high, t, df, two_sided(t, df), boot.mean / deviation)


def two_sided(t: float, df: int) -> float:
    """p of a t value: .013 of 4.28 with 4 degrees of freedom."""
    return float(2 * student.sf(abs(t), df))
