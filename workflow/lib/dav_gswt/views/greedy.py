"""Greedy choice where a gain only falls as others are chosen: looked at again only as far as it must be."""

import heapq
from collections.abc import Callable, Iterable


def lazy_greedy(gains: Iterable[float], look: Callable[[int], float], take: Callable[[int], None], k: int) -> list[int]:
    """The k items that plain greedy chooses: one whose gain is still the largest after another look is the largest.

    gains: of each item before anything is chosen. look: its gain now. take: it is chosen. Ties by index.
    Source: Minoux, Accelerated greedy algorithms for maximizing submodular set functions, 1978.
    """
    queue = [(-gain, i) for i, gain in enumerate(gains)]
    heapq.heapify(queue)
    chosen: list[int] = []
    while queue and len(chosen) < k:
        _, i = heapq.heappop(queue)
        now = look(i)
        if queue and (-now, i) > queue[0]:
            heapq.heappush(queue, (-now, i))
            continue
        chosen.append(i)
        take(i)
    return chosen
