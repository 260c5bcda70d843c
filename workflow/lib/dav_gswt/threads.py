"""Networks on one thread: on several PyTorch sums in another order, and a file's bytes would tell how many."""

from contextlib import contextmanager


@contextmanager
def one_thread():
    import torch  # here, not above: it takes seconds to load, and not everything that may need it does

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
