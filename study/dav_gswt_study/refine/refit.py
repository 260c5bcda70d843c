"""Refit the Gaussians of a tile to repaired pictures of it, each within its bounds."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.field import SH0, GaussianField, concatenate_fields
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt_study.refine.limits import Bounds
from dav_gswt_study.refine.viewpoints import SeamView

RATE = 0.2  # of Adam, in bounds
BETAS = (0.8, 0.95)
EPSILON = 0.1  # of Adam, relative to the root mean square of all gradients
COLOUR, OPACITY, POSITION = slice(0, 3), 3, slice(4, 7)


@dataclass(frozen=True)
class RefitTarget:
    """The target picture of a camera, and the weights of its pixels."""

    place: SeamView
    camera: Camera
    picture: Float32[Array, "s s 3"]
    weight: Float32[Array, "s s"]


def refit_gaussians(
    field: GaussianField, targets: list[RefitTarget], bounds: Bounds, moves: Float32[Array, "n 7"], steps: int
) -> tuple[Float32[Array, "n 7"], float, float]:
    """Fit colours, opacities and positions of the free Gaussians to all pictures at once, by `steps` steps of Adam.

    The loss is the weighted mean square error over all pictures. Unknowns are in units of their bounds and are clipped
    to [-1, 1] after every step.

    Args:    field: before any change. moves: the changes so far.
    Returns: the moves, and the root of the loss at the start and at the end.
    """
    scale = bounds.scale
    before, gradient = _gradient(apply_moves(field, moves, scale), targets, scale)
    after, size = before, float(np.sqrt((gradient.astype(float) ** 2).sum() / max(1, bounds.free.sum())))
    if size == 0:
        return moves, before, before
    moves, first, second = moves.copy(), np.zeros_like(moves), np.zeros_like(moves)
    for step in range(1, steps + 1):
        rate = RATE * (1 - (step - 1) / steps)
        raster.adam(moves, gradient / np.float32(size), first, second, rate, step, BETAS, epsilon=EPSILON)
        np.clip(moves, -1, 1, out=moves)
        after, gradient = _gradient(apply_moves(field, moves, scale), targets, scale)
    return moves, before, after


def apply_moves(field: GaussianField, moves: Float32[Array, "n 7"], scale: Float32[Array, "n 7"]) -> GaussianField:
    """The field changed by shares of the bounds; Gaussians without a change keep their bits."""
    by = moves * scale
    rows = np.flatnonzero(by.any(1))
    sh, logits, means = field.sh.copy(), field.opacity_logits.copy(), field.means.copy()
    sh[rows, 0] += by[rows, COLOUR] / np.float32(SH0)
    logits[rows] += by[rows, OPACITY]
    means[rows] += by[rows, POSITION]
    return replace(field, sh=sh, opacity_logits=logits, means=means)


def _gradient(
    field: GaussianField, targets: list[RefitTarget], scale: Float32[Array, "n 7"]
) -> tuple[float, Float32[Array, "n 7"]]:
    """The root of the loss, and its gradient with respect to the moves."""
    total, gradient = 0.0, np.zeros((len(field), 7), float)
    rasterizer = make_rasterizer()
    for one in targets:
        own, k = one.place.own, len(one.place.own)
        seen = rasterizer.forward(
            **to_raster_arrays(concatenate_fields([field[own], one.place.around])), camera=one.camera
        )
        apart = one.weight[..., None] * (seen.colour - one.picture)
        total += float((apart.astype(float) ** 2).mean())
        found = rasterizer.backward(np.ascontiguousarray(2 * one.weight[..., None] * apart / apart.size, np.float32))
        gradient[own, COLOUR] += found.colours[:k, 0] / SH0
        gradient[own, OPACITY] += found.opacity_logits[:k]
        gradient[own, POSITION] += found.means[:k]
    return float(np.sqrt(total / max(1, len(targets)))), (gradient * scale / max(1, len(targets))).astype(np.float32)
