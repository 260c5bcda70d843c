"""Small scenes for the rasterizer's tests."""

from dataclasses import replace

import numpy as np

from dav_gswt import cameras

NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours")


def cloud(n=300, seed=0, size=0.08):
    """n Gaussians around the origin, some of them nearly opaque."""
    rng = np.random.default_rng(seed)
    logits = rng.normal(0, 2, n)
    logits[: n // 10] = 6
    values = (
        rng.normal(0, 0.6, (n, 3)),
        np.log(size) + rng.normal(0, 0.5, (n, 3)),
        rng.normal(size=(n, 4)),
        logits,
        rng.uniform(0, 1, (n, 3)),
    )
    return [np.ascontiguousarray(v, np.float32) for v in values]


def camera(width=70, height=52, orthographic=False):
    """A camera off every axis, so that no term of the projection is 0."""
    made = cameras.pinhole([1.6, -2.1, 1.3], [0.1, 0.05, -0.1], width, height, 50.0)
    made = replace(made, cy=made.cy + 3.3, cx=made.cx - 2.2, fy=made.fy * 1.1)
    return replace(made, fx=22.0, fy=24.0, orthographic=True) if orthographic else made


def one(mean=(0.0, 0, 0), sigma=0.1, opacity=0.5, colour=(1.0, 0.5, 0.25)):
    """One round Gaussian."""
    return [
        np.array([mean], np.float32),
        np.full((1, 3), np.log(sigma), np.float32),
        np.array([[1, 0, 0, 0]], np.float32),
        np.array([np.log(opacity / (1 - opacity))], np.float32),
        np.array([colour], np.float32),
    ]
