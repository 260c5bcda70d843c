"""How often one of two was chosen, with an interval that knows that one person's answers are alike.

A plain binomial counts every answer as if another person had given it. People differ, so their answers are clusters,
and the share of all moves with who happened to take part: the binomial interval is too narrow, its p too small.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.stats import beta, binomtest
from scipy.stats import t as student

LEVEL = 0.95


@dataclass(frozen=True)
class Share:
    """Of answers that chose the first: the mean over participants, the ends of its interval, a two-sided p against 1/2
    with so many degrees of freedom, and as how many independent answers they count (`worth`). None where nothing tells.
    """

    participants: int
    answers: int
    share: float | None
    low: float | None
    high: float | None
    p: float | None
    df: int
    worth: float | None


def clustered(chosen: Float[Array, "g"], asked: Float[Array, "g"]) -> Share:
    """The share over all participants, each counting the same, with a 95 % interval of other participants.

    With p_i = chosen / asked of each of G participants, p their mean and v = var(p_i) / G (ddof 1), the answers are
    worth n = p (1 - p) / v independent ones: at least one, at most as many as were given. The interval is Wilson's
    of p and n with the quantile of Student's t with G - 1 degrees of freedom, which stays within [0, 1] and is neither
    empty nor too short near its ends; p is of the same statistic, (p - 1/2) / sqrt(1 / (4 n)).
    Where all participants have the same share, v = 0 tells nothing, and each is worth one answer: the fewest there
    can be. One participant alone has no interval. It tells of other people who see these crops, not of other crops.

    Args:   chosen, asked: of each participant: answers that chose the first, and all; asked > 0.
    Raises: ValueError: nobody, nobody asked, or more chosen than asked.
    Source: Wilson (1927), with Kish's effective sample size and t for few clusters (Franco et al. 2019).
    """
    if not len(asked) or not (asked > 0).all() or (chosen < 0).any() or (chosen > asked).any():
        raise ValueError("shares need participants who were asked, and chose no oftener than that")
    own, people, answers = chosen / asked, len(asked), int(asked.sum())
    mean, df = float(own.mean()), people - 1
    if df == 0:
        return Share(people, answers, mean, None, None, None, df, None)
    variance = float(own.var(ddof=1)) / people
    alike = variance < 1e-12  # and not 0: equal shares of unequal numbers differ by rounding
    worth = float(people if alike else np.clip(mean * (1 - mean) / variance, 1, answers))
    p = float(2 * student.sf(abs(mean - 0.5) * 2 * np.sqrt(worth), df))
    low, high = wilson(mean, worth, float(student.ppf((1 + LEVEL) / 2, df)))
    return Share(people, answers, mean, low, high, p, df, worth)


def wilson(share: float, n: float, z: float) -> tuple[float, float]:
    """Both ends of the shares s with |share - s| <= z sqrt(s (1 - s) / n)."""
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(share * (1 - share) / n + (z / (2 * n)) ** 2) / (1 + z * z / n)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def binomial(chosen: int, answers: int) -> tuple[float, float, float]:
    """The exact interval (Clopper and Pearson) and p of a plain binomial: what the paper used. Too sure, see above."""
    tail = (1 - LEVEL) / 2
    low = float(beta.ppf(tail, chosen, answers - chosen + 1)) if chosen else 0.0
    high = float(beta.ppf(1 - tail, chosen + 1, answers - chosen)) if chosen < answers else 1.0
    return low, high, float(binomtest(chosen, answers).pvalue)
