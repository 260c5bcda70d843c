"""Growth: Gaussians that show nothing go where the residual is, and new ones follow them, under a cap.

After 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024): a source is split into copies that together look as it
did, and nearly transparent Gaussians are shaken so that they find something to do. Sources are drawn by the squared
error that the photos carry back onto them, not by opacity: more detail where it lacks, none where all is said.
"""

from math import comb

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.reconstruction.fitting.state import NAMES, State

DEAD = 0.005  # opacity below which a Gaussian shows nothing
MOST_COPIES = 8  # of one source at a time
CHILD = np.log(0.5)  # a detail on the ground starts at half its disc's size
SHAKE = 0.3  # standard deviations that a transparent Gaussian is shaken a step, at the start
LOOSE = DEAD + np.log(99) / 100  # opacity from which none is shaken: its share of the strength would be under .01


def opacities(logits: Float[Array, "n"]) -> Float[Array, "n"]:
    """The peak opacity."""
    return 1 / (1 + np.exp(-np.asarray(logits, float)))


def grow(
    state: State, fixed: int, lost: Bool[Array, "n"], errors: Float[Array, "n"], cap: int, rng: np.random.Generator
) -> int:
    """Move the dead and the lost among the free Gaussians to where the errors are, and add others up to `cap`.

    errors: squared error carried back onto each Gaussian. Returns how many were moved or added; 0 without any error.
    """
    dead = (opacities(state.values["opacity_logits"]) < DEAD) | lost
    dead[:fixed] = False
    weight = np.where(dead, 0, errors).astype(float)
    places = np.flatnonzero(dead)
    count = len(places) + max(0, cap - len(state))
    if not count or not weight.sum() > 0:
        return 0
    drawn = rng.choice(len(weight), count, p=weight / weight.sum())
    sources, copies = np.unique(drawn, return_counts=True)
    copies = np.minimum(copies, MOST_COPIES)
    born = _born(state, sources, copies, fixed, rng)
    count = len(born["means"])
    places = places[:count]
    state.put(places, {k: v[: len(places)] for k, v in born.items()})
    state.append({k: v[len(places) :] for k, v in born.items()})
    return count


def shake(state: State, fixed: int, strength: float, rng: np.random.Generator) -> None:
    """Move nearly transparent free Gaussians at random within themselves; opaque ones stay."""
    values = state.values
    rows = fixed + np.flatnonzero(values["opacity_logits"][fixed:] < np.log(LOOSE / (1 - LOOSE)))
    if not len(rows):
        return
    loose = 1 / (1 + np.exp(100 * (opacities(values["opacity_logits"][rows]) - DEAD)))
    noise = rng.standard_normal((len(rows), 3), np.float32) * (strength * loose[:, None]).astype(np.float32)
    values["means"][rows] += along(values, rows, noise)


def along(values: dict[str, Array], rows: Int[Array, "m"], steps: Float[Array, "m 3"]) -> Float32[Array, "m 3"]:
    """Steps given in standard deviations along a Gaussian's own axes, in the world."""
    quats = values["quats"][rows]
    w, x, y, z = (quats / np.sqrt(np.einsum("mi,mi->m", quats, quats))[:, None]).T
    a, b, c = (steps * np.exp(values["log_scales"][rows])).T
    p, q, r = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c  # u x s + w s; then s + 2 u x that
    moved = [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)]
    return np.stack(moved, 1).astype(np.float32)


def split(opacity: Float[Array, "n"], parts: Int[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n"]]:
    """Opacity of each of `parts` equal copies, and the factor of their size, that together look like the one before.

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


def _born(state: State, sources: Array, copies: Array, fixed: int, rng: np.random.Generator) -> dict[str, Array]:
    """The new rows; free sources become one of the copies."""
    values = state.values
    free = sources >= fixed
    rows, parts = sources[free], copies[free] + 1
    each, size = split(opacities(values["opacity_logits"][rows]), parts)
    values["opacity_logits"][rows] = np.log(each / (1 - each))
    values["log_scales"][rows] += np.log(size)[:, None].astype(np.float32)
    for part in (state.first, state.second):
        for name in NAMES:
            part[name][rows] = 0
    repeated = np.repeat(sources, copies)
    born = {name: values[name][repeated].copy() for name in NAMES}
    child = repeated < fixed
    born["log_scales"][child, :2] += np.float32(CHILD)
    born["opacity_logits"][child] = 0
    spread = rng.uniform(-0.7, 0.7, (len(repeated), 3)) * [1, 1, 0]
    born["means"] += along(values, repeated, np.where(child[:, None], spread, rng.normal(0, 0.5, (len(repeated), 3))))
    return born
