"""Short routes through places."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

LEAST = 1e-9  # relative shortening below which two orders count as equally long


def order_stops(
    places: Float[Array, "n d"], start: Float[Array, "d"] | None = None, end: Float[Array, "d"] | None = None
) -> tuple[int, ...]:
    """Order in which to visit places: nearest neighbour, then 2-opt. Without `start` or `end` these are free.

    Deterministic, ties go to the first; no reversal of a stretch shortens the result.
    Source: Croes, A Method for Solving Traveling-Salesman Problems (1958).
    """
    n = len(places)
    first = np.zeros(places.shape[1]) if start is None else start
    stops = np.concatenate([places, first[None], places[:0] if end is None else end[None]])
    far = np.linalg.norm(stops[:, None] - stops[None], axis=-1)
    if start is None:
        far[n], far[:, n] = 0.0, 0.0  # a start that is as near to every place
    path, unvisited = [n], list(range(n))
    while unvisited:
        path.append(unvisited.pop(int(np.argmin(far[path[-1], unvisited]))))
    return tuple(_shorten([*path, *range(n + 1, len(far))], far, closed=end is not None)[1 : n + 1])


def path_length(places: Float[Array, "n d"]) -> float:
    """Length of the path through places in their order."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _shorten(path: list[int], far: Float[Array, "m m"], closed: bool) -> list[int]:
    """2-opt: reverse stretches while that shortens the path; the start stays first, the end (if closed) last."""
    way = np.array(path)
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
    return way.tolist()
