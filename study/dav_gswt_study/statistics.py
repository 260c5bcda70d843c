"""Statistics of the studies: paired comparisons, bootstrap intervals, tests of means and of shares.

The unit of a comparison is a pair of runs with one scene and one seed. Intervals are percentile intervals of a
bootstrap. The resampling is our own: `scipy.stats.bootstrap` draws neither scenes with seeds within them, nor clusters
of different sizes that several groups share.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy import stats
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint

REPLICATES = 10_000  # of the bootstrap over scenes and seeds
CLUSTER_REPLICATES = 4000  # of the bootstrap over clusters
LEVEL = 0.95  # of intervals
SEED = 0  # of the bootstrap, in published tables

ClusterSums = dict[str, Float[Array, "_"]]  # by cluster: sums of some values, and last how many rows they are of


@dataclass(frozen=True)
class PairedTest:
    """mean: of the differences, over scenes; low, high: its 95 % bootstrap interval. t, df, p: of the paired t-test,
    two-sided; d: mean over the deviation within scenes (Cohen's d). None where it is not defined."""

    units: int
    mean: float
    low: float | None
    high: float | None
    t: float | None
    df: int
    p: float | None
    d: float | None


@dataclass(frozen=True)
class ClusteredShare:
    """A share of answers: mean over participants, ends of its interval, two-sided p against 1/2 with `df` degrees of
    freedom, and the effective number of independent answers. None where it is not defined."""

    participants: int
    answers: int
    share: float
    low: float | None
    high: float | None
    p: float | None
    df: int
    effective_answers: float | None


def bootstrap_paired(
    differences: dict[str, Float[Array, "_"]], seed: int = SEED, level: float = LEVEL, replicates: int = REPLICATES
) -> tuple[float, float, float]:
    """Mean of paired differences, and the ends of its interval by a two-stage bootstrap: scenes, then seeds of each.

    With a single scene only its seeds are drawn, and the interval tells nothing about other scenes.

    Args:   differences: by scene, one value a seed.
    Raises: ValueError: no difference, or one that is not finite.
    """
    scenes = [values for values in differences.values() if len(values)]
    if not scenes or not np.isfinite(np.concatenate(scenes)).all():
        raise ValueError("a comparison needs differences, all of them finite")
    rng, means = np.random.default_rng(seed), np.empty(replicates)
    for i in range(replicates):
        drawn = (scenes[j] for j in rng.integers(len(scenes), size=len(scenes)))
        means[i] = np.mean([np.mean(values[rng.integers(len(values), size=len(values))]) for values in drawn])
    low, high = np.quantile(means, [(1 - level) / 2, (1 + level) / 2])
    return float(np.mean([values.mean() for values in scenes])), float(low), float(high)


def compute_paired_test(differences: dict[str, Float[Array, "_"]]) -> PairedTest:
    """Paired t-test of differences, by scene, one pair a seed.

    Scenes are fixed, seeds are random: with n pairs in S scenes the deviation s within scenes has n - S degrees of
    freedom, the mean m of the scenes' means has the variance s^2 / S^2 sum(1 / n_s), and t = m / sqrt of that. For one
    scene it is the usual paired test with n - 1 degrees of freedom. It tells about other seeds, not about other scenes.
    With one pair a scene (df 0), or equal differences, t, p and d are None.
    Raises: ValueError: no difference, or one that is not finite.
    """
    mean, *ends = bootstrap_paired(differences)
    groups = [values for values in differences.values() if len(values)]
    units, scenes = sum(map(len, groups)), len(groups)
    df = units - scenes
    squares = sum(float(((values - values.mean()) ** 2).sum()) for values in groups)
    low, high = ends if units > 1 else (None, None)
    if df == 0 or squares == 0:
        return PairedTest(units, mean, low, high, None, df, None, None)
    deviation = float(np.sqrt(squares / df))
    t = mean / (deviation * float(np.sqrt(sum(1 / len(values) for values in groups))) / scenes)
    return PairedTest(units, mean, low, high, t, df, two_sided_p(t, df), mean / deviation)


def subtract_or_none(a: float | None, b: float | None) -> float | None:
    """a - b; None where one of them is not known."""
    return None if a is None or b is None else float(a - b)


def two_sided_p(t: float, df: int) -> float:
    """Two-sided p of a t value: .013 for t = 4.28 with 4 degrees of freedom."""
    return float(2 * stats.t.sf(abs(t), df))


def adjust_holm(p: dict[str, float]) -> dict[str, float]:
    """p values of several comparisons, adjusted for their number by Holm's method."""
    if not p:
        return {}
    adjusted = multipletests(list(p.values()), method="holm")[1]
    assert adjusted is not None
    return dict(zip(p, adjusted.tolist(), strict=True))


def sum_by_cluster(rows: Iterable[tuple[str, list[float | None]]]) -> ClusterSums:
    """Sums of values by cluster, their count last; rows with an unknown value are left out."""
    out: ClusterSums = {}
    for cluster, values in rows:
        if all(v is not None and np.isfinite(v) for v in values):
            out[cluster] = out.get(cluster, np.zeros(len(values) + 1)) + [*values, 1.0]
    return out


def bootstrap_clusters(*groups: ClusterSums, seed: int = SEED) -> list[Float[Array, "replicates _"]]:
    """Means of the values of each group: the first row as measured, then bootstrap replicates over clusters.

    Clusters of one name are drawn together in all groups. A replicate without any row of a group is NaN there.
    """
    names = sorted({name for group in groups for name in group}) or [""]
    shares = np.full(len(names), 1 / len(names))
    weights = np.random.default_rng(seed).multinomial(len(names), shares, CLUSTER_REPLICATES)
    weights = np.concatenate([np.ones((1, len(names))), weights])
    out = []
    for group in groups:
        width = len(next(iter(group.values()), np.zeros(2)))
        table = np.array([group.get(name, np.zeros(width)) for name in names]).reshape(-1, width)
        total = weights @ table
        with np.errstate(invalid="ignore"):
            out.append(total[:, :-1] / total[:, -1:])
    return out


def percentile_interval(values: Float[Array, "replicates"]) -> tuple[float, float, float]:
    """The measured value (first) and the ends of the 95 % interval of its replicates."""
    low, high = np.nanquantile(values[1:], [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(values[0]), float(low), float(high)


def compute_clustered_share(chosen: Float[Array, "g"], asked: Float[Array, "g"]) -> ClusteredShare:
    """Share of answers that chose the first of two, with a 95 % interval over participants.

    Answers of one participant are alike, so participants are clusters, and each counts the same. With
    p_i = chosen / asked of each of G participants, p their mean and v = var(p_i) / G (ddof 1), the effective number of
    answers is n = p (1 - p) / v, clipped to [1, answers]. The interval is Wilson's of p and n with the quantile of
    Student's t with G - 1 degrees of freedom; p is of the statistic (p - 1/2) / sqrt(1 / (4 n)).
    If all shares are equal (v = 0), n = G. A single participant has no interval. It tells about other participants who
    see these crops, not about other crops.

    Args:   chosen, asked: of each participant, answers that chose the first, and all; asked > 0.
    Raises: ValueError: no participant, nobody asked, or more chosen than asked.
    Source: Wilson (1927), with Kish's effective sample size and t for few clusters (Franco et al. 2019).
    """
    if not len(asked) or not (asked > 0).all() or (chosen < 0).any() or (chosen > asked).any():
        raise ValueError("shares need participants who were asked, and chose no oftener than that")
    own, people, answers = chosen / asked, len(asked), int(asked.sum())
    mean, df = float(own.mean()), people - 1
    if df == 0:
        return ClusteredShare(people, answers, mean, None, None, None, df, None)
    variance = float(own.var(ddof=1)) / people
    equal = variance < 1e-12  # not 0: equal shares of unequal numbers differ by rounding
    effective = float(people if equal else np.clip(mean * (1 - mean) / variance, 1, answers))
    p = two_sided_p((mean - 0.5) * 2 * np.sqrt(effective), df)
    low, high = wilson_interval(mean, effective, float(stats.t.ppf((1 + LEVEL) / 2, df)))
    return ClusteredShare(people, answers, mean, low, high, p, df, effective)


def wilson_interval(share: float, n: float, z: float) -> tuple[float, float]:
    """Ends of the shares s with |share - s| <= z sqrt(s (1 - s) / n); n need not be whole."""
    low, high = np.array(proportion_confint(share * n, n, alpha=2 * stats.norm.sf(z), method="wilson"), float).tolist()
    return max(0.0, low), min(1.0, high)


def compute_binomial_test(chosen: int, answers: int) -> tuple[float, float, float]:
    """Exact interval (Clopper and Pearson) and p of a plain binomial, as in the paper; too narrow, since it takes every
    answer for another person's."""
    found = stats.binomtest(chosen, answers)
    interval = found.proportion_ci(LEVEL, method="exact")
    return float(interval.low), float(interval.high), float(found.pvalue)
