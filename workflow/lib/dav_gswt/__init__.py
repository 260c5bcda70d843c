"""DAV-GSWT: Gaussian-splat Wang tiles from a few photos. One subpackage a stage, shared vocabulary beside them."""

__version__ = "0.1.0"
