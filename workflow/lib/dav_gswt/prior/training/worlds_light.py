"""Light of a made-up world, baked into colours: a sun with cast shadows, a sky that crannies see less of."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter, maximum_filter

HALF, CELL = 9.0, 0.06  # metres: the map of what casts shadows reaches so far from the middle, in such cells
STEPS, LONGEST = 26, 5.0  # places that are looked at on the way to the sun, and how far away at most
BIAS = 0.05  # metres above itself that a thing must be overtopped to lie in shadow
CRANNIES = (0.15, 0.6)  # metres: scales on which the surroundings take light from the sky


@dataclass(frozen=True)
class Light:
    """Where the sun stands (unit vector), its light and the sky's, linear; softness: of shadows, a slope."""

    towards: Float[Array, "3"]
    sun: Float[Array, "3"]
    sky: Float[Array, "3"]
    softness: float


def some_light(rng: np.random.Generator) -> Light:
    """A sun between 15 and 80 degrees, warmer as it sinks, or behind clouds."""
    up, around = np.radians(rng.uniform(15, 80)), rng.uniform(0, 2 * np.pi)
    towards = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    warm = np.array([1.0, 0.93, 0.82]) ** rng.uniform(0.3, 2.2 - 1.5 * np.sin(up))
    clear = 0.15 * rng.uniform() if rng.uniform() < 0.2 else rng.uniform(0.5, 1.0)
    blue = np.array([0.80, 0.92, 1.10]) ** (clear * rng.uniform(0.3, 1.2))
    strength = 1.0 / max(0.35, towards[2])
    return Light(towards, strength * clear * warm, rng.uniform(0.25, 0.6) * blue, rng.uniform(0.01, 0.06))


@dataclass(frozen=True)
class Shade:
    """A map of what stands: its tops, and how much of a cell they fill."""

    tops: Float[Array, "n n"]
    cover: Float[Array, "n n"]

    def at(self, image: Float[Array, "n n"], x: Float[Array, "m"], y: Float[Array, "m"]) -> Float[Array, "m"]:
        """The map's value at places; its border's beyond."""
        n = len(image)
        column, row = (np.clip((v + HALF) / CELL, 0, n - 1).astype(np.int32) for v in (x, y))
        return image[row, column]


def shade(
    ground: Float[Array, "n n"], points: Float[Array, "m 3"], areas: Float[Array, "m"], sizes: Float[Array, "m"]
) -> Shade:
    """The map of a ground (heights at the cells' centres) and of things' Gaussians that block `areas` each."""
    n = len(ground)
    column, row = ((points[:, k] + HALF) / CELL for k in (0, 1))
    inside = (column >= 0) & (row >= 0) & (column < n) & (row < n)
    at = row[inside].astype(int), column[inside].astype(int)
    tops = np.full((n, n), -1e3)
    np.maximum.at(tops, at, points[inside, 2] + 0.5 * sizes[inside])
    filled = np.zeros((n, n))
    np.add.at(filled, at, areas[inside] / CELL**2)
    cover = 1 - np.exp(-1.5 * gaussian_filter(filled, 0.7, mode="nearest"))
    spread = maximum_filter(tops, 3)
    bare = spread <= ground
    return Shade(np.where(bare, ground, spread).astype(np.float32), np.where(bare, 1, cover).astype(np.float32))


def cells() -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """x and y of the map's cells' centres."""
    axis = np.arange(-HALF + CELL / 2, HALF, CELL)
    return tuple(np.meshgrid(axis, axis))


def sunlit(light: Light, shaded: Shade, points: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """How much of the sun reaches points: 1 all, 0 none.

    From each point the map's tops are looked at towards the sun; what a top lacks to the ray, as a slope against
    `softness`, is the penumbra. A cell that is filled in part lets the rest through.
    """
    away = LONGEST * (np.arange(1, STEPS + 1) / STEPS) ** 1.7
    flat = np.hypot(*light.towards[:2])
    highest = float(shaded.tops.max())
    x, y, z = (points[:, k].astype(np.float32) for k in range(3))
    lit = np.ones(len(points), np.float32)
    for t in away:
        ray = z + np.float32(BIAS + t * light.towards[2] / flat)
        rows = np.flatnonzero(ray < highest)
        if not len(rows):
            break
        ax = x[rows] + np.float32(t * light.towards[0] / flat)
        ay = y[rows] + np.float32(t * light.towards[1] / flat)
        over = shaded.at(shaded.tops, ax, ay) - ray[rows]
        blocked = np.clip(0.5 + over / np.float32(2 * light.softness * t + 0.02), 0, 1)
        lit[rows] = np.minimum(lit[rows], 1 - blocked * shaded.at(shaded.cover, ax, ay))
    return lit


def open_sky(shaded: Shade, points: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """Share of the sky that points see: less where the surroundings, blurred on two scales, are higher."""
    seen = np.ones(len(points))
    for scale in CRANNIES:
        around = gaussian_filter(shaded.tops, scale / CELL, mode="nearest")
        over = np.maximum(shaded.at(around, points[:, 0], points[:, 1]) - points[:, 2], 0)
        seen *= 1 / (1 + 1.2 * over / scale)
    return seen


def lit(
    light: Light,
    shaded: Shade,
    points: Float[Array, "n 3"],
    normals: Float[Array, "n 3"],
    albedo: Float[Array, "n 3"],
    firm: Float[Array, "n"],
    around: Float[Array, "3"],
) -> Float[Array, "n 3"]:
    """Linear light that leaves points. firm: 1 where the surface has one side, 0 where light comes through it.
    around: albedo of the ground, which throws light back at what faces it."""
    cosine = normals @ light.towards
    direct = firm * np.maximum(cosine, 0) + (1 - firm) * (0.25 + 0.6 * np.abs(cosine))
    direct = direct * sunlit(light, shaded, points)
    up = firm * (0.5 + 0.5 * normals[:, 2]) + (1 - firm) * 0.8
    indirect = up * open_sky(shaded, points)
    bounced = 0.12 * light.sun * light.towards[2] * around
    return albedo * (direct[:, None] * light.sun + indirect[:, None] * light.sky + (1 - up)[:, None] * bounced)
