"""Densification: transparent Gaussians are relocated to where the residual is, and new ones added, up to a number.

After 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024): a source is split into copies that together look like
it, and nearly transparent Gaussians are perturbed. Sources are sampled by the squared error that the photos project
back onto them, not by opacity: detail is added only where it lacks.
"""

from math import comb

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.reconstruction.fitting.state import NAMES, State

DEAD = 0.005  # opacity below which a Gaussian is relocated
MAX_COPIES = 8  # of one source in one event
DETAIL_SIZE = np.log(0.5)  # of a detail on the ground, over its disc's size
PERTURBATION = 0.3  # standard deviations a step, of a transparent Gaussian at the start
MAX_PERTURBED = DEAD + np.log(99) / 100  # opacity above which the perturbation's share would be under .01
LOOSE_LOGIT = float(np.log(MAX_PERTURBED / (1 - MAX_PERTURBED)))


def to_opacity(logits: Float[Array, "n"]) -> Float[Array, "n"]:
    """The peak opacity."""
    return 1 / (1 + np.exp(-np.asarray(logits, float)))


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
    dead = (to_opacity(state.values["opacity_logits"]) < DEAD) | misplaced
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
    loose = 1 / (1 + np.exp(100 * (to_opacity(values["opacity_logits"][rows]) - DEAD)))
    noise = rng.standard_normal((len(rows), 3), np.float32) * (strength * loose[:, None]).astype(np.float32)
    values["means"][rows] += rotate_steps(values, rows, noise)


def rotate_steps(values: dict[str, Array], rows: Int[Array, "m"], steps: Float[Array, "m 3"]) -> Float32[Array, "m 3"]:
    """World vectors of steps given in standard deviations along each Gaussian's axes."""
    quats = values["quats"][rows]
    w, x, y, z = (quats / np.sqrt(np.einsum("mi,mi->m", quats, quats))[:, None]).T
    a, b, c = (steps * np.exp(values["log_scales"][rows])).T
    p, q, r = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c  # u x s + w s; then s + 2 u x that
    moved = [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)]
    return np.stack(moved, 1).astype(np.float32)


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
    values = state.values
    free = sources >= fixed
    rows, parts = sources[free], copies[free] + 1
    each, size = split_opacity(to_opacity(values["opacity_logits"][rows]), parts)
    values["opacity_logits"][rows] = np.log(each / (1 - each))
    values["log_scales"][rows] += np.log(size)[:, None].astype(np.float32)
    for part in (state.first, state.second):
        for name in NAMES:
            part[name][rows] = 0
    repeated = np.repeat(sources, copies)
    copied = {name: values[name][repeated].copy() for name in NAMES}
    of_ground = repeated < fixed
    copied["log_scales"][of_ground, :2] += np.float32(DETAIL_SIZE)
    copied["opacity_logits"][of_ground] = 0
    spread = rng.uniform(-0.7, 0.7, (len(repeated), 3)) * [1, 1, 0]
    copied["means"] += rotate_steps(
        values, repeated, np.where(of_ground[:, None], spread, rng.normal(0, 0.5, (len(repeated), 3)))
    )
    return copied
