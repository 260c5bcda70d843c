"""An order of places that is short to walk or to fly."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

LEAST = 1e-9  # a shortening, as a share of the whole way, below which two orders count as equally long


def order(
    places: Float[Array, "n d"], start: Float[Array, "d"] | None = None, end: Float[Array, "d"] | None = None
) -> tuple[int, ...]:
    """The order in which to visit places: nearest neighbour, then 2-opt. Without `start` or `end` these are free.

    Always the same for the same places: ties go to the first. No stretch of the way can be turned round to shorten it.
    Source: Croes, A Method for Solving Traveling-Salesman Problems (1958).
    """
    n = len(places)
    first = np.zeros(places.shape[1]) if start is None else start
    stops = np.concatenate([places, first[None], places[:0] if end is None else end[None]])
    far = np.linalg.norm(stops[:, None] - stops[None], axis=-1)
    if start is None:
        far[n], far[:, n] = 0.0, 0.0  # a start that is as near to every place
    return tuple(int(i) for i in _turned(_nearest(far, n), far, closed=end is not None)[1 : n + 1])


def length(places: Float[Array, "n d"]) -> float:
    """How long the way through places is, in their order."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _nearest(far: Float[Array, "m m"], n: int) -> list[int]:
    """From the start (stop n) always to the nearest place not visited yet, at last to the end if there is one."""
    way, left = [n], list(range(n))
    while left:
        way.append(left.pop(int(np.argmin(far[way[-1], left]))))
    return way + list(range(n + 1, len(far)))


def _turned(way: list[int], far: Float[Array, "m m"], closed: bool) -> Array:
    """Turn stretches of the way round as long as that shortens it; the start stays first, the end (if closed) last."""
    way = np.array(way)
    least = LEAST * (1 + far[way[:-1], way[1:]].sum())
    last = len(way) - (1 if closed else 0)  # stretches [i, j] lie within 1 .. last - 1
    shorter = True
    while shorter:
        shorter = False
        for i in range(1, last - 1):
            j = np.arange(i + 1, last)
            before, first, final = way[i - 1], way[i], way[j]
            follows = np.append(way[i + 2 :], -1)[: len(j)]
            tail = follows >= 0  # nothing follows the last place of an open way
            gain = far[before, first] - far[before, final]
            gain = gain + np.where(tail, far[final, follows] - far[first, follows], 0.0)
            if gain.max() > least:
                k = int(j[np.argmax(gain)])
                way[i : k + 1] = way[i : k + 1][::-1].copy()
                shorter = True
    return way
