"""Light of a procedural world, baked into colours: a sun with cast shadows, and a sky with ambient occlusion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter, maximum_filter

HALF, CELL = 9.0, 0.06  # metres: half the side of the shadow map, and its cells
STEPS, LONGEST = 26, 5.0  # of the march towards the sun, and its length in metres
BIAS = 0.05  # metres: an occluder must be higher than the ray by more
OCCLUSION_SCALES = (0.15, 0.6)  # metres


@dataclass(frozen=True)
class Light:
    """towards: unit vector to the sun. sun, sky: linear light. softness: of shadows, a slope."""

    towards: Float[Array, "3"]
    sun: Float[Array, "3"]
    sky: Float[Array, "3"]
    softness: float


def draw_light(rng: np.random.Generator) -> Light:
    """A random sun between 15 and 80 degrees, warmer when low, sometimes behind clouds."""
    up, around = np.radians(rng.uniform(15, 80)), rng.uniform(0, 2 * np.pi)
    towards = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    warm = np.array([1.0, 0.93, 0.82]) ** rng.uniform(0.3, 2.2 - 1.5 * np.sin(up))
    clear = 0.15 * rng.uniform() if rng.uniform() < 0.2 else rng.uniform(0.5, 1.0)
    blue = np.array([0.80, 0.92, 1.10]) ** (clear * rng.uniform(0.3, 1.2))
    strength = 1.0 / max(0.35, towards[2])
    return Light(towards, strength * clear * warm, rng.uniform(0.25, 0.6) * blue, rng.uniform(0.01, 0.06))


@dataclass(frozen=True)
class ShadowMap:
    """A map of occluders: height of their tops, and the share of a cell that they cover."""

    tops: Float[Array, "n n"]
    cover: Float[Array, "n n"]

    def lookup(self, image: Float[Array, "n n"], x: Float[Array, "m"], y: Float[Array, "m"]) -> Float[Array, "m"]:
        """Values of a map at places; beyond the map, those of its border."""
        n = len(image)
        column, row = (np.clip((v + HALF) / CELL, 0, n - 1).astype(np.int32) for v in (x, y))
        return image[row, column]


@dataclass(frozen=True)
class Surface:
    """Points to be lit. opaque: 1 where the surface has one side, 0 where light comes through."""

    points: Float[Array, "n 3"]
    normals: Float[Array, "n 3"]
    albedo: Float[Array, "n 3"]
    opaque: Float[Array, "n"]


def map_shadows(
    ground: Float[Array, "n n"], points: Float[Array, "m 3"], areas: Float[Array, "m"], sizes: Float[Array, "m"]
) -> ShadowMap:
    """The shadow map of ground heights at the cells' centres and of objects' Gaussians that cover `areas`."""
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
    return ShadowMap(np.where(bare, ground, spread).astype(np.float32), np.where(bare, 1, cover).astype(np.float32))


def cell_centres() -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """x and y of the centres of the shadow map's cells."""
    axis = np.arange(-HALF + CELL / 2, HALF, CELL)
    x, y = np.meshgrid(axis, axis)
    return x, y


def sun_visibility(light: Light, shadows: ShadowMap, points: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """The share of the sun that reaches points.

    The tops of the map are compared with the ray from each point to the sun; the difference as a slope, relative to
    `softness`, is the penumbra. A cell that is covered in part lets the rest through.
    """
    away = LONGEST * (np.arange(1, STEPS + 1) / STEPS) ** 1.7
    flat = np.hypot(*light.towards[:2])
    highest = float(shadows.tops.max())
    x, y, z = (points[:, k].astype(np.float32) for k in range(3))
    lit = np.ones(len(points), np.float32)
    for t in away:
        ray = z + np.float32(BIAS + t * light.towards[2] / flat)
        rows = np.flatnonzero(ray < highest)
        if not len(rows):
            break
        ax = x[rows] + np.float32(t * light.towards[0] / flat)
        ay = y[rows] + np.float32(t * light.towards[1] / flat)
        over = shadows.lookup(shadows.tops, ax, ay) - ray[rows]
        blocked = np.clip(0.5 + over / np.float32(2 * light.softness * t + 0.02), 0, 1)
        lit[rows] = np.minimum(lit[rows], 1 - blocked * shadows.lookup(shadows.cover, ax, ay))
    return lit


def sky_visibility(shadows: ShadowMap, points: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """The share of the sky that points see: less where the surroundings, blurred on two scales, are higher."""
    seen = np.ones(len(points))
    for scale in OCCLUSION_SCALES:
        around = gaussian_filter(shadows.tops, scale / CELL, mode="nearest")
        over = np.maximum(shadows.lookup(around, points[:, 0], points[:, 1]) - points[:, 2], 0)
        seen *= 1 / (1 + 1.2 * over / scale)
    return seen


def reflect(light: Light, shadows: ShadowMap, surface: Surface, around: Float[Array, "3"]) -> Float[Array, "n 3"]:
    """Linear light that leaves a surface. around: mean albedo of the ground, which reflects light too."""
    points, normals, opaque = surface.points, surface.normals, surface.opaque
    cosine = normals @ light.towards
    direct = opaque * np.maximum(cosine, 0) + (1 - opaque) * (0.25 + 0.6 * np.abs(cosine))
    direct = direct * sun_visibility(light, shadows, points)
    up = opaque * (0.5 + 0.5 * normals[:, 2]) + (1 - opaque) * 0.8
    indirect = up * sky_visibility(shadows, points)
    bounced = 0.12 * light.sun * light.towards[2] * around
    return surface.albedo * (direct[:, None] * light.sun + indirect[:, None] * light.sky + (1 - up)[:, None] * bounced)
