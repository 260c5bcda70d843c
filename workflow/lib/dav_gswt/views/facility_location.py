"""Facility location: choose poses so that every doubtful pose has a photo near it, taken or chosen.

f(S) = sum over candidates v of u_v max over s in S and the photos taken of sim(v, s). It is monotone and submodular:
the greedy choice reaches 1 - 1/e of the best. u = 1 is plain coverage. (The paper's objective is a sum over the chosen
alone, whose exact optimum is the top k: neighbours of the most doubtful pose, all alike.)
"""

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.views.greedy import lazy_greedy

REACH = 0.5  # median distances of candidates from the middle, over which a photo tells about its neighbours


def similarity(a: Float[Array, "n 3"], b: Float[Array, "m 3"], reach: float) -> Float64[Array, "n m"]:
    """exp(-d^2 / 2 reach^2) of places: 1 where they coincide, 0 far apart."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    squares = (a**2).sum(1)[:, None] + (b**2).sum(1) - 2 * a @ b.T
    return np.exp(-np.maximum(squares, 0) / (2 * reach**2))


def kernel_width(places: Float[Array, "n 3"]) -> float:
    """Raises: ValueError: all places lie in the middle."""
    if not len(places):
        return 1.0
    usual = float(np.median(np.linalg.norm(places, axis=1)))
    if not usual > 0:
        raise ValueError("candidate poses lie in the middle of what they look at")
    return REACH * usual


def coverage_gains(
    near: Float64[Array, "n n"], covered: Float64[Array, "n"], u: Float64[Array, "n"]
) -> Float64[Array, "n"]:
    """What each candidate would add. near: similarity of candidates (rows) and choices (columns)."""
    return u @ np.maximum(near - covered[:, None], 0)


def select_facilities(
    places: Float[Array, "n 3"], taken: Float[Array, "m 3"], u: Float[Array, "n"], k: int
) -> list[int]:
    """The k candidates that greedy chooses, or all; ties by index.

    Raises: ValueError: u below 0 or not finite.
    """
    if not (np.isfinite(u).all() and (u >= 0).all()):
        raise ValueError("the weight of a candidate must be a number of at least 0")
    reach = kernel_width(places)
    near = similarity(places, places, reach)
    covered = similarity(places, taken, reach).max(1, initial=0.0)
    weight = u.astype(np.float64)

    def look(i: int) -> float:
        return float(weight @ np.maximum(near[:, i] - covered, 0))

    def take(i: int) -> None:
        np.maximum(covered, near[:, i], out=covered)

    return lazy_greedy(coverage_gains(near, covered, weight), look, take, k)
