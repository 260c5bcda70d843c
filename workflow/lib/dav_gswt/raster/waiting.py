"""Threads that wait must sleep, not spin: a spinning team turns 2 ms into 12 ms where others use the machine too."""

import os
from contextlib import contextmanager


@contextmanager
def patiently():
    """An import in this block loads OpenMP's library, which reads its wait policy then and never again.

    Too late where somebody has loaded it before, as PyTorch does with its own copy: so import the rasterizer first.
    Results do not depend on it.
    """
    before = os.environ.get("OMP_WAIT_POLICY")
    os.environ["OMP_WAIT_POLICY"] = before or "PASSIVE"
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_WAIT_POLICY"]
