"""Thread settings, applied where work starts and not on import."""

import os
from contextlib import contextmanager


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
