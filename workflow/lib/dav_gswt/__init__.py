"""DAV-GSWT: Gaussian-splat Wang tiles from a few photos. One subpackage a stage, shared vocabulary beside them."""

import os

__version__ = "0.1.0"

# Threads that wait must sleep, not spin: a spinning team turns 2 ms into 12 ms where others use the machine too. OpenMP
# reads this when its library is loaded and never again: so here, before the core or PyTorch loads it.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
