"""Facility location: choose poses so that every uncertain pose has a photo nearby.

f(S) = sum over candidates v of u_v max over s in S and the captured photos of sim(v, s). It is monotone and submodular:
greedy reaches 1 - 1/e of the optimum. u = 1 is plain coverage. (The paper's objective is a sum over the chosen poses
alone; its exact optimum is the top k, which are often neighbours.)
"""

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.views.greedy import lazy_greedy

WIDTH = 0.5  # of the kernel, in median distances of the candidates from the middle


def similarity(a: Float[Array, "n 3"], b: Float[Array, "m 3"], width: float) -> Float64[Array, "n m"]:
    """exp(-d^2 / (2 width^2)) of positions: 1 where they coincide, 0 far apart."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    squares = (a**2).sum(1)[:, None] + (b**2).sum(1) - 2 * a @ b.T
    return np.exp(-np.maximum(squares, 0) / (2 * width**2))


def kernel_width(places: Float[Array, "n 3"]) -> float:
    """Width of the similarity kernel for these candidates. Raises: ValueError: all lie in the middle."""
    if not len(places):
        return 1.0
    usual = float(np.median(np.linalg.norm(places, axis=1)))
    if not usual > 0:
        raise ValueError("candidate poses lie in the middle of what they look at")
    return WIDTH * usual


def coverage_gains(
    near: Float64[Array, "n n"], covered: Float64[Array, "n"], u: Float64[Array, "n"]
) -> Float64[Array, "n"]:
    """Gain of each candidate. near: similarity of candidates (rows) and choices (columns)."""
    return u @ np.maximum(near - covered[:, None], 0)


def select_facilities(
    places: Float[Array, "n 3"], taken: Float[Array, "m 3"], u: Float[Array, "n"], k: int
) -> list[int]:
    """Choose k candidates greedily, or all; ties by index.

    taken: positions of the captured photos. u: weight of each candidate. Raises: ValueError: u below 0 or not finite.
    """
    if not (np.isfinite(u).all() and (u >= 0).all()):
        raise ValueError("the weight of a candidate must be a number of at least 0")
    width = kernel_width(places)
    near = similarity(places, places, width)
    covered = similarity(places, taken, width).max(1, initial=0.0)
    weight = u.astype(np.float64)

    def gain(i: int) -> float:
        return float(weight @ np.maximum(near[:, i] - covered, 0))

    def take(i: int) -> None:
        np.maximum(covered, near[:, i], out=covered)

    return lazy_greedy(coverage_gains(near, covered, weight), gain, take, k)
