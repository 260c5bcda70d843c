"""The fit: gradient descent on what the photos see, with the ground kept a ground.

One photo a step, L1 + D-SSIM, Adam, a random colour behind the picture (so that dark grains are not modelled by
transparency). Discs keep to their cell, to the surface's tangent plane and to near-full opacity; their heights move
together (the gradient is blurred over the grid), so that the surface stays closed under grazing views.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray as Array

from dav_gswt.coarse import ground
from dav_gswt.coarse.discs import THICKNESS, quaternions
from dav_gswt.coarse.ground import Ground
from dav_gswt.field import Field, sh_of
from dav_gswt.logs import progress
from dav_gswt.raster import cpu
from dav_gswt.views import View

STRUCTURE = 0.2  # weight of D-SSIM against L1
RATES = {"log_scales": 5e-3, "quats": 1e-3, "opacity_logits": 2.5e-2, "colours": 2.5e-3}
DRIFT = 0.02  # spacings a step, at the start; falls to a tenth
TOGETHER = 2.0  # cells over which heights move together
KEEP = 10  # steps between two projections onto the constraints
ASPECT = np.log(6.0)  # a thing is at most this much longer than thick: no needles
BACKDROP = 0.5  # strength of the random background's pull to opacity


@dataclass
class _State:
    """What Adam moves, and its two moments, by name."""

    values: dict[str, Array]
    first: dict[str, Array]
    second: dict[str, Array]


def fit(
    field: Field, grid: Ground, views: list[View], steps: int, band: float, rng: np.random.Generator, what: str
) -> Field:
    """Fit a field whose first Gaussians are the grid's discs, row by row, to views.

    band: how far things may stand above the surface. steps: optimiser steps, one view each; views come in shuffled
    turns. A view's weight decides which of its pixels count.
    Returns: the field with the grid's discs in their order, then the things that are left.
    """
    state = _start(field)
    discs = int(field.ground.sum())
    raster = cpu.Rasterizer()
    turn: list[int] = []
    for step in progress(range(steps), what):
        if not turn:
            turn = list(rng.permutation(len(views)))
        view = views[turn.pop()]
        gradients = _gradients(raster, state.values, view, rng.uniform(0, 1, 3).astype(np.float32))
        _descend(state, gradients, grid, discs, step, steps)
        if step % KEEP == KEEP - 1 or step == steps - 1:
            _constrain(state.values, grid, discs, band)
    return _finished(field, state.values, discs)


def _start(field: Field) -> _State:
    values = {
        "means": field.means.copy(),
        "log_scales": field.log_scales.copy(),
        "quats": field.quats.copy(),
        "opacity_logits": field.opacity_logits.copy(),
        "colours": np.ascontiguousarray(field.base_colours, np.float32),
    }
    return _State(values, *({k: np.zeros_like(v) for k, v in values.items()} for _ in range(2)))


def _gradients(raster: cpu.Rasterizer, values: dict[str, Array], view: View, behind: Array):
    """Gradients of the loss of one view, over a background of one random colour."""
    seen = raster.forward(**values, camera=view.camera)
    clear = (1 - seen.alpha)[..., None]
    image = seen.colour + clear * behind
    _, grad = cpu.loss(image, view.image, view.weight, STRUCTURE)
    return raster.backward(grad, -BACKDROP * (grad @ behind))


def _descend(state: _State, gradients, grid: Ground, discs: int, step: int, steps: int) -> None:
    up = gradients.means[:discs, 2].reshape(grid.shape)
    gradients.means[:discs, 2] = ground.smoothed(up, TOGETHER).ravel()
    gradients.quats[:discs] = 0  # discs follow the surface's tangent plane: see _constrain
    rates = RATES | {"means": DRIFT * grid.spacing * 0.1 ** (step / steps)}
    for name, value in state.values.items():
        cpu.adam(
            value, getattr(gradients, name), state.first[name], state.second[name], rate=rates[name], step=step + 1
        )


def _constrain(values: dict[str, Array], grid: Ground, discs: int, band: float) -> None:
    """Project onto what a ground with things on it may be."""
    s = grid.spacing
    means, scales, logits = values["means"], values["log_scales"], values["opacity_logits"]
    home = grid.centres[:, :2]
    means[:discs, :2] = np.clip(means[:discs, :2], home - 0.49 * s, home + 0.49 * s)
    surface = replace(grid, heights=means[:discs, 2].reshape(grid.shape).astype(float))
    values["quats"][:discs] = quaternions(*(g.ravel() for g in surface.slopes()))
    np.clip(scales[:discs, :2], np.log(0.5 * s), np.log(1.5 * s), out=scales[:discs, :2])
    scales[:discs, 2] = np.log(THICKNESS * s)
    np.clip(logits[:discs], 2.5, 6.0, out=logits[:discs])
    if len(means) > discs:
        free = scales[discs:]
        np.clip(free, np.log(0.2 * s), np.log(1.5 * s), out=free)
        np.maximum(free, free.max(1, keepdims=True) - ASPECT, out=free)
        above = means[discs:, 2] - surface.height_at(means[discs:])
        logits[discs:][(above < -s) | (above > band)] = -8.0
    np.clip(values["colours"], 0, 1, out=values["colours"])


def _finished(field: Field, values: dict[str, Array], discs: int) -> Field:
    fitted = replace(
        field,
        means=values["means"],
        log_scales=values["log_scales"],
        quats=values["quats"],
        opacity_logits=values["opacity_logits"],
        sh=sh_of(values["colours"]),
    )
    alive = field.ground | (values["opacity_logits"] > -4.0)
    return fitted[alive]
