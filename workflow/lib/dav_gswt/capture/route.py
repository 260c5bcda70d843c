"""Short routes through places."""

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

LEAST = 1e-9  # relative shortening below which two orders count as equally long


def order_stops(
    places: Float[Array, "n d"], start: Float[Array, "d"] | None = None, end: Float[Array, "d"] | None = None
) -> tuple[int, ...]:
    """Order in which to visit places: nearest neighbour, then 2-opt. Without `start` or `end` these are free.

    Deterministic, ties go to the first; no reversal of a stretch shortens the result.
    Source: Croes, A Method for Solving Traveling-Salesman Problems (1958).
    """
    n, none = len(places), np.zeros(places.shape[1])
    stops = np.stack([*places, *(none if given is None else given for given in (start, end))])
    far = np.linalg.norm(stops[:, None] - stops[None], axis=-1)
    for i, given in ((n, start), (n + 1, end)):
        if given is None:
            far[i], far[:, i] = 0.0, 0.0  # a free end is as near to every place
    path, unvisited = [n], list(range(n))
    while unvisited:
        path.append(unvisited.pop(int(np.argmin(far[path[-1], unvisited]))))
    return tuple(_shorten(np.array([*path, n + 1]), far)[1:-1].tolist())


def path_length(places: Float[Array, "n d"]) -> float:
    """Length of the path through places in their order."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _shorten(way: Int[Array, "m"], far: Float[Array, "m m"]) -> Int[Array, "m"]:
    """2-opt: reverse stretches while that shortens the way; its ends stay where they are."""
    least = LEAST * (1 + far[way[:-1], way[1:]].sum())
    last, shorter = len(way) - 1, True
    while shorter:
        shorter = False
        for i in range(1, last - 1):
            j = np.arange(i + 1, last)
            before, first, final, follows = way[i - 1], way[i], way[j], way[j + 1]
            gain = far[before, first] - far[before, final] + far[final, follows] - far[first, follows]
            if gain.max() > least:
                k = int(j[np.argmax(gain)])
                way[i : k + 1] = way[i : k + 1][::-1].copy()
                shorter = True
    return way
