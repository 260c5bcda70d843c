"""Weights of LPIPS that learned nothing, for what holds whatever they are."""

import numpy as np

from dav_gswt.perceptual import weights


def random():
    """Values of about the size that keeps features of unit size; heads not below 0, as LPIPS's are."""
    rng = np.random.default_rng(0)

    def drawn(shape, size):
        return (size * rng.standard_normal(shape)).astype(np.float32)

    return weights.Weights(
        tuple(drawn(s, (2 / np.prod(s[1:])) ** 0.5) for s in weights.KERNELS),
        tuple(drawn(s[:1], 0.1) for s in weights.KERNELS),
        tuple(np.abs(drawn(s[:1], 0.3)) for s in weights.KERNELS),
    )
