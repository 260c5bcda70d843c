"""Densification: transparent Gaussians are relocated to where the residual is, and new ones added, up to a number.

After 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024): a source is split into copies that together look like
it, and nearly transparent Gaussians are perturbed. Sources are sampled by the squared error that the photos project
back onto them, not by opacity: detail is added only where it lacks.
"""

from math import comb
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt import arrays
from dav_gswt.reconstruction.fitting.state import State

DEAD = 0.005  # opacity below which a Gaussian is relocated
MAX_COPIES = 8  # of one source in one event
DETAIL_SIZE = np.log(0.5)  # of a detail on the ground, over its disc's size
PERTURBATION = 0.3  # standard deviations a step, of a transparent Gaussian at the start
MAX_PERTURBED = DEAD + np.log(99) / 100  # opacity above which the perturbation's share would be under .01
LOOSE_LOGIT = float(np.log(MAX_PERTURBED / (1 - MAX_PERTURBED)))


def to_opacity(logits: Float[Any, "n"]) -> Float[Any, "n"]:
    """The peak opacity."""
    return 1 / (1 + arrays.namespace(logits).exp(-arrays.to_double(logits)))


def grow(
    state: State,
    fixed: int,
    misplaced: Bool[Array, "n"],
    errors: Float[Array, "n"],
    max_gaussians: int,
    rng: np.random.Generator,
) -> int:
    """Relocate transparent and misplaced free Gaussians to where the errors are, and add others up to `max_gaussians`.

    errors: squared error projected back onto each Gaussian. Returns the number relocated or added; 0 without error.
    """
    dead = (to_opacity(arrays.on_host(state.values["opacity_logits"])) < DEAD) | misplaced
    dead[:fixed] = False
    weight = np.where(dead, 0, errors).astype(float)
    places = np.flatnonzero(dead)
    count = len(places) + max(0, max_gaussians - len(state))
    if not count or not weight.sum() > 0:
        return 0
    sampled = rng.choice(len(weight), count, p=weight / weight.sum())
    sources, copies = np.unique(sampled, return_counts=True)
    copies = np.minimum(copies, MAX_COPIES)
    copied = _make_copies(state, sources, copies, fixed, rng)
    count = len(copied["means"])
    places = places[:count]
    state.overwrite(places, {k: v[: len(places)] for k, v in copied.items()})
    state.append({k: v[len(places) :] for k, v in copied.items()})
    return count


def perturb(values: dict[str, Array], fixed: int, strength: float, rng: np.random.Generator) -> None:
    """Move nearly transparent free Gaussians by random steps within their size; opaque ones stay."""
    rows = fixed + np.flatnonzero(values["opacity_logits"][fixed:] < LOOSE_LOGIT)
    if not len(rows):
        return
    move_loose(values, rows, strength, rng.standard_normal((len(rows), 3), np.float32))


def move_loose(values: dict[str, Any], rows: Any, strength: float, noise: Float32[Any, "m 3"]) -> None:
    """Move those of some Gaussians (indices or a slice) that are nearly transparent. noise: standard normal."""
    logits = values["opacity_logits"][rows]
    loose = 1 / (1 + arrays.namespace(logits).exp(100 * (to_opacity(logits) - DEAD)))
    share = arrays.to_single(strength * loose) * (logits < LOOSE_LOGIT)
    values["means"][rows] += rotate_steps(values, rows, noise * share[:, None])


def rotate_steps(values: dict[str, Any], rows: Any, steps: Float[Any, "m 3"]) -> Float32[Any, "m 3"]:
    """World vectors of steps given in standard deviations along the axes of some Gaussians (indices or a slice)."""
    quats = values["quats"][rows]
    xp = arrays.namespace(quats)
    w, x, y, z = (quats / xp.sqrt(xp.einsum("mi,mi->m", quats, quats))[:, None]).T
    a, b, c = (steps * xp.exp(values["log_scales"][rows])).T
    p, q, r = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c  # u x s + w s; then s + 2 u x that
    moved = [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)]
    return arrays.to_single(xp.stack(moved, 1))


def split_opacity(opacity: Float[Array, "n"], parts: Int[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n"]]:
    """Opacity of each of `parts` equal copies, and the factor of their size, that together look like the source.

    (1 - o')^parts = 1 - o keeps the peak; the factor keeps the integral along a line through it (Kheradmand et al.,
    Eq. 9). parts = 1 changes nothing.
    """
    opacity = np.clip(np.asarray(opacity, float), 1e-6, 1 - 1e-6)
    each = -np.expm1(np.log1p(-opacity) / parts)
    total = np.zeros_like(each)
    for i in range(1, int(parts.max(initial=0)) + 1):
        row = sum(comb(i - 1, k) * (-1) ** k / np.sqrt(k + 1) * each ** (k + 1) for k in range(i))
        total += np.where(i <= parts, row, 0)
    return each, np.where(parts > 1, opacity / np.maximum(total, 1e-12), 1)


def _make_copies(state: State, sources: Array, copies: Array, fixed: int, rng: np.random.Generator) -> dict[str, Array]:
    """The new rows; a free source becomes one of its copies."""
    values, free = state.read(sources), sources >= fixed
    each, size = split_opacity(to_opacity(values["opacity_logits"][free]), copies[free] + 1)
    values["opacity_logits"][free] = np.log(each / (1 - each))
    values["log_scales"][free] += np.log(size)[:, None].astype(np.float32)
    state.overwrite(sources[free], {name: values[name][free] for name in ("opacity_logits", "log_scales")})
    repeated = np.repeat(np.arange(len(sources)), copies)
    copied = {name: value[repeated] for name, value in values.items()}
    of_ground = sources[repeated] < fixed
    copied["log_scales"][of_ground, :2] += np.float32(DETAIL_SIZE)
    copied["opacity_logits"][of_ground] = 0
    spread = rng.uniform(-0.7, 0.7, (len(repeated), 3)) * [1, 1, 0]
    copied["means"] += rotate_steps(
        values, repeated, np.where(of_ground[:, None], spread, rng.normal(0, 0.5, (len(repeated), 3)))
    )
    return copied
