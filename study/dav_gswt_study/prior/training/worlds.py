"""Procedural worlds to train the prior on: dense Gaussian fields of random ground with random objects on it.

They share no generator with the families of synthetic scenes, since priors are evaluated on those. A true view is a
render of the field, which takes milliseconds. The same seed gives the same world, to the bit.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.reconstruction.discs import slopes_to_quaternions
from dav_gswt_study.prior.training import worlds_ground as ground
from dav_gswt_study.prior.training import worlds_light as light
from dav_gswt_study.prior.training import worlds_objects as objects
from dav_gswt_study.prior.training.worlds_objects import Cloud

FLYING_HEIGHT = 7.0  # metres, as of synthetic scenes
THICKNESS = 0.1  # of a disc, in its spacings
OPACITY = 0.98  # of the ground's discs
MEAN_LIGHT = 0.09, 0.4  # linear, of the middle of a photo: the range from which the exposure is drawn
WHITE = 0.95  # the brightest light of the ground (its 0.95 quantile) after exposure


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
    """A world whose colours include its light. frame: as in ground.json."""

    field: GaussianField
    frame: SceneFrame
    sky: Sky


def make_world(seed: int) -> World:
    """The world of a seed. Raises: ValueError: a negative seed."""
    rng = np.random.default_rng([seed, 20_000])
    relief = ground.draw_relief(rng)
    discs, cloud = ground.make_discs(rng, relief), objects.scatter_objects(rng, relief.height)
    sun = light.draw_light(rng)
    areas = 4 * cloud.scales[:, 0] * cloud.scales[:, 1] * cloud.opacity
    shadows = light.map_shadows(relief.height(*light.cell_centres()), cloud.means, areas, cloud.scales[:, 0])
    around = discs.albedo.mean(0)
    below, above = _light_ground(sun, shadows, discs, around), _light_objects(sun, shadows, cloud, around)
    near = np.abs(discs.means[:, :2]).max(1) < ground.EXEMPLAR / 2
    mean = np.exp(rng.uniform(*np.log(MEAN_LIGHT))) / below[near].mean()
    exposure = min(mean, WHITE / np.quantile(below[near], 0.95))
    field = concatenate_fields([_make_ground(discs, exposure * below), _make_objects(cloud, exposure * above)])
    return World(field, _make_frame(), _draw_sky(rng, sun))


def _light_ground(
    sun: light.Light, shadows: light.ShadowMap, discs: ground.Discs, around: Float[Array, "3"]
) -> Float[Array, "n 3"]:
    normals = np.stack([-discs.east, -discs.north, np.ones_like(discs.east)], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return light.reflect(sun, shadows, light.Surface(discs.means, normals, discs.albedo, np.ones(len(normals))), around)


def _light_objects(
    sun: light.Light, shadows: light.ShadowMap, cloud: Cloud, around: Float[Array, "3"]
) -> Float[Array, "n 3"]:
    x, y, z, w = cloud.quats.T
    normals = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], 1)
    return light.reflect(sun, shadows, light.Surface(cloud.means, normals, cloud.albedo, cloud.opaque), around)


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


def _draw_sky(rng: np.random.Generator, sun: light.Light) -> Sky:
    blue = np.clip((sun.sun.mean() * sun.towards[2]) / 0.9, 0, 1)
    cloudy = np.full(3, rng.uniform(0.6, 0.95))
    zenith = cloudy + blue * (np.array([0.25, 0.45, 0.8]) * rng.uniform(0.8, 1.2) - cloudy)
    horizon = cloudy + blue * (np.array([0.75, 0.84, 0.93]) * rng.uniform(0.9, 1.05) - cloudy)
    return Sky(*(np.clip(c + rng.normal(0, 0.03, 3), 0, 1) for c in (zenith, horizon)))
