"""Threads: how many there are, how they wait, and work whose results do not depend on their number."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from queue import SimpleQueue
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
MAX_THREADS = 16


def default_threads() -> int:
    """DAV_GSWT_THREADS, or the processors that this process may use, at most MAX_THREADS."""
    if given := os.environ.get("DAV_GSWT_THREADS"):
        if not given.isdecimal() or int(given) < 1:
            raise ValueError(f"DAV_GSWT_THREADS={given}: give a whole number from 1")
        return int(given)
    return min(len(os.sched_getaffinity(0)), MAX_THREADS)


def let_waiting_threads_sleep() -> None:
    """Let waiting OpenMP threads sleep, not spin: a spinning team takes several times as long on a busy machine.

    OpenMP reads the setting once, when its library is loaded: call this before the rasterizer's core or PyTorch is.
    A setting of the user's stays.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


@contextmanager
def one_thread():
    """PyTorch on one thread: with several it sums in another order, and results depend on their number."""
    import torch  # deferred: it takes seconds to load

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def map_ahead(function: Callable[[Item], Result], items: Iterable[Item], threads: int) -> Iterator[Result]:
    """Yield a function's result of each item, in their order, while the next ones are worked on.

    No more than `threads` results wait, however slowly they are taken.
    """
    with ThreadPoolExecutor(threads) as pool:
        ahead: deque[Future[Result]] = deque()
        for item in items:
            ahead.append(pool.submit(function, item))
            if len(ahead) > threads:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()


def map_in_single_threads(workers: Sequence[Callable[[Item], Result]], items: Iterable[Item]) -> Iterator[Result]:
    """Yield a worker's result of each item, in their order, with as many items at work as there are workers.

    Each item is worked on by one thread of PyTorch, so no result depends on the number of workers. The workers are
    copies of one function, since two threads cannot share a state such as a network's dropout masks.
    """
    free: SimpleQueue[Callable[[Item], Result]] = SimpleQueue()
    for worker in workers:
        free.put(worker)

    def run(item: Item) -> Result:
        worker = free.get()
        try:
            with one_thread():
                return worker(item)
        finally:
            free.put(worker)

    with ThreadPoolExecutor(len(workers)) as pool:
        yield from pool.map(run, items)
