"""Procedural worlds to train the prior on: dense Gaussian fields of random ground with random objects on it.

They share no generator with the families of synthetic scenes, since priors are evaluated on those. A true view is a
render of the field, which takes milliseconds. The same seed gives the same world, to the bit.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter, maximum_filter

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.reconstruction.discs import slopes_to_quaternions
from dav_gswt_study.prior.training import worlds_ground as ground
from dav_gswt_study.prior.training import worlds_objects as objects
from dav_gswt_study.prior.training.worlds_objects import Cloud

FLYING_HEIGHT = 7.0  # metres, as of synthetic scenes
THICKNESS = 0.1  # of a disc, in its spacings
OPACITY = 0.98  # of the ground's discs
MEAN_LIGHT = 0.09, 0.4  # linear, of the middle of a photo: the range from which the exposure is drawn
WHITE = 0.95  # the brightest light of the ground (its 0.95 quantile) after exposure
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


@dataclass(frozen=True)
class Sky:
    """sRGB colours at the zenith and at the horizon."""

    zenith: Float[Array, "3"]
    horizon: Float[Array, "3"]

    def render(self, camera: Camera) -> Float32[Array, "h w 3"]:
        """The sky as a camera sees it."""
        direction = camera.rays()[1]
        up = np.clip(direction[..., 2] / np.linalg.norm(direction, axis=-1), 0, 1)[..., None] ** 0.6
        return (self.horizon + up * (self.zenith - self.horizon)).astype(np.float32)


@dataclass(frozen=True)
class World:
    """A world whose colours include its  frame: as in ground.json."""

    field: GaussianField
    frame: SceneFrame
    sky: Sky


def make_world(seed: int) -> World:
    """The world of a seed. Raises: ValueError: a negative seed."""
    rng = np.random.default_rng([seed, 20_000])
    relief = ground.draw_relief(rng)
    discs, cloud = ground.make_discs(rng, relief), objects.scatter_objects(rng, relief.height)
    sun = draw_light(rng)
    areas = 4 * cloud.scales[:, 0] * cloud.scales[:, 1] * cloud.opacity
    shadows = map_shadows(relief.height(*cell_centres()), cloud.means, areas, cloud.scales[:, 0])
    around = discs.albedo.mean(0)
    below, above = _light_ground(sun, shadows, discs, around), _light_objects(sun, shadows, cloud, around)
    near = np.abs(discs.means[:, :2]).max(1) < ground.EXEMPLAR / 2
    mean = np.exp(rng.uniform(*np.log(MEAN_LIGHT))) / below[near].mean()
    exposure = min(mean, WHITE / np.quantile(below[near], 0.95))
    field = concatenate_fields([_make_ground(discs, exposure * below), _make_objects(cloud, exposure * above)])
    return World(field, _make_frame(), _draw_sky(rng, sun))


def _light_ground(
    sun: Light, shadows: ShadowMap, discs: ground.Discs, around: Float[Array, "3"]
) -> Float[Array, "n 3"]:
    normals = np.stack([-discs.east, -discs.north, np.ones_like(discs.east)], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return reflect(sun, shadows, Surface(discs.means, normals, discs.albedo, np.ones(len(normals))), around)


def _light_objects(sun: Light, shadows: ShadowMap, cloud: Cloud, around: Float[Array, "3"]) -> Float[Array, "n 3"]:
    x, y, z, w = cloud.quats.T
    normals = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], 1)
    return reflect(sun, shadows, Surface(cloud.means, normals, cloud.albedo, cloud.opaque), around)


def _make_ground(discs: ground.Discs, radiance: Float[Array, "n 3"]) -> GaussianField:
    stretch = np.stack([np.sqrt(1 + discs.east**2), np.sqrt(1 + discs.north**2)], 1)
    scales = np.column_stack([ground.WIDTH * discs.sizes * stretch, THICKNESS * discs.sizes.min(1)])
    opacity = np.full(len(radiance), OPACITY)
    return _make_field(discs.means, scales, slopes_to_quaternions(discs.east, discs.north), opacity, radiance, True)


def _make_objects(cloud: Cloud, radiance: Float[Array, "n 3"]) -> GaussianField:
    return _make_field(cloud.means, cloud.scales, cloud.quats[:, [3, 0, 1, 2]], cloud.opacity, radiance, False)


def _make_field(
    means: Array, scales: Array, quats: Array, opacity: Array, radiance: Float[Array, "n 3"], is_ground: bool
) -> GaussianField:
    n = len(means)
    return GaussianField(
        means.astype(np.float32),
        np.log(scales).astype(np.float32),
        quats.astype(np.float32),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        rgb_to_sh(ground.encode_light(radiance)),
        np.zeros(n, np.float32),
        np.full(n, is_ground),
    )


def _make_frame() -> SceneFrame:
    half = ground.EXEMPLAR / 2
    reach = 1.25 * half
    exemplar, extent = Square(-half, -half, ground.EXEMPLAR), Extent(-reach, -reach, reach, reach)
    return SceneFrame("synthetic", "metre", FLYING_HEIGHT, exemplar, extent)


def _draw_sky(rng: np.random.Generator, sun: Light) -> Sky:
    blue = np.clip((sun.sun.mean() * sun.towards[2]) / 0.9, 0, 1)
    cloudy = np.full(3, rng.uniform(0.6, 0.95))
    zenith = cloudy + blue * (np.array([0.25, 0.45, 0.8]) * rng.uniform(0.8, 1.2) - cloudy)
    horizon = cloudy + blue * (np.array([0.75, 0.84, 0.93]) * rng.uniform(0.9, 1.05) - cloudy)
    return Sky(*(np.clip(c + rng.normal(0, 0.03, 3), 0, 1) for c in (zenith, horizon)))
