"""Pareto front: points that no other point matches in cost and beats in worth."""

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array


def find_pareto_front(cost: Float[Array, " n"], worth: Float[Array, " n"]) -> Bool[Array, " n"]:
    """Points that no other point dominates (costs no more and is worth no less, one of the two strictly).

    Equal points are on the front together. One pass by rising cost, for O(n log n).
    Raises: ValueError: a value that is not a number.
    """
    _check_finite(cost, worth)
    on, best = np.zeros(len(cost), bool), -np.inf
    for price in np.unique(cost):
        at = cost == price
        top = worth[at].max()
        if top > best:
            on[at], best = worth[at] == top, top
    return on


def find_rivals(cost: Float[Array, " n"], worth: Float[Array, " n"]) -> Int[Array, " n"]:
    """For each point the one worth most among those that cost no more; itself where none is worth more.

    How far it lies behind the front is worth[rival] - worth, from 0. Raises: ValueError: as `front`.
    """
    _check_finite(cost, worth)
    found = np.arange(len(cost))
    for i in found:
        affordable = np.where(cost <= cost[i], worth, -np.inf)
        if affordable.max() > worth[i]:
            found[i] = int(affordable.argmax())
    return found


def _check_finite(*values: Float[Array, " n"]) -> None:
    if not all(np.isfinite(value).all() for value in values):
        raise ValueError("a point's cost or worth is not a number")
