"""Made-up worlds to train the prior on: dense Gaussian fields of random ground with random things on it.

They are mixed from ingredients of their own: none is a family that synthetic scenes come from, since priors are judged
on those. True views are the field drawn, in milliseconds. Same seed: same world, to the bit.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.prior.training import worlds_ground as ground
from dav_gswt.prior.training import worlds_light as light
from dav_gswt.prior.training import worlds_objects as things
from dav_gswt.prior.training.worlds_objects import Cloud
from dav_gswt.reconstruction.discs import quaternions

FLYING_HEIGHT = 7.0  # metres, as synthetic scenes have it
THICK = 0.1  # of a disc, in its spacings
OPACITY = 0.98  # of the ground's discs
GREY = 0.09, 0.4  # mean light of the middle of a photo, linear: the exposure is drawn between
WHITE = 0.95  # most of the ground's light that a photo holds, as a share of it


@dataclass(frozen=True)
class Sky:
    """Colours straight up and at the horizon, sRGB."""

    zenith: Float[Array, "3"]
    horizon: Float[Array, "3"]

    def behind(self, camera: Camera) -> Float32[Array, "h w 3"]:
        """What a camera sees where nothing stands."""
        direction = camera.rays()[1]
        up = np.clip(direction[..., 2] / np.linalg.norm(direction, axis=-1), 0, 1)[..., None] ** 0.6
        return (self.horizon + up * (self.zenith - self.horizon)).astype(np.float32)


@dataclass(frozen=True)
class World:
    """A world with its light in its colours."""

    field: GaussianField
    frame: SceneFrame
    sky: Sky


def world(seed: int) -> World:
    """The world of a seed. Raises: ValueError: a negative seed."""
    rng = np.random.default_rng([seed, 20_000])
    land = ground.terrain(rng)
    flat, cloud = ground.discs(rng, land), things.things(rng, land.height)
    sun = light.some_light(rng)
    areas = 4 * cloud.scales[:, 0] * cloud.scales[:, 1] * cloud.opacity
    shaded = light.shade(land.height(*light.cells()), cloud.means, areas, cloud.scales[:, 0])
    around = flat.albedo.mean(0)
    below, above = _lit_ground(sun, shaded, flat, around), _lit_things(sun, shaded, cloud, around)
    near = np.abs(flat.means[:, :2]).max(1) < ground.EXEMPLAR / 2
    mean = np.exp(rng.uniform(*np.log(GREY))) / below[near].mean()
    exposure = min(mean, WHITE / np.quantile(below[near], 0.95))
    field = concatenate_fields([_ground(flat, ground.encoded(exposure * below)), _things(cloud, exposure * above)])
    return World(field, _frame(), _sky(rng, sun))


def _lit_ground(
    sun: light.Light, shaded: light.Shade, flat: ground.Discs, around: Float[Array, "3"]
) -> Float[Array, "n 3"]:
    normals = np.stack([-flat.east, -flat.north, np.ones_like(flat.east)], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return light.lit(sun, shaded, flat.means, normals, flat.albedo, np.ones(len(normals)), around)


def _lit_things(sun: light.Light, shaded: light.Shade, cloud: Cloud, around: Float[Array, "3"]) -> Float[Array, "n 3"]:
    x, y, z, w = cloud.quats.T
    normals = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], 1)
    return light.lit(sun, shaded, cloud.means, normals, cloud.albedo, cloud.firm, around)


def _ground(flat: ground.Discs, colours: Float[Array, "n 3"]) -> GaussianField:
    n = len(colours)
    stretch = np.stack([np.sqrt(1 + flat.east**2), np.sqrt(1 + flat.north**2)], 1)
    scales = np.column_stack([ground.WIDTH * flat.sizes * stretch, THICK * flat.sizes.min(1)])
    return _field(flat.means, scales, quaternions(flat.east, flat.north), np.full(n, OPACITY), colours, True)


def _things(cloud: Cloud, shine: Float[Array, "n 3"]) -> GaussianField:
    return _field(cloud.means, cloud.scales, cloud.quats[:, [3, 0, 1, 2]], cloud.opacity, ground.encoded(shine), False)


def _field(means, scales, quats, opacity, colours, is_ground: bool) -> GaussianField:
    n = len(means)
    return GaussianField(
        means.astype(np.float32),
        np.log(scales).astype(np.float32),
        quats.astype(np.float32),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        rgb_to_sh(colours),
        np.zeros(n, np.float32),
        np.full(n, is_ground),
    )


def _frame() -> SceneFrame:
    half = ground.EXEMPLAR / 2
    reach = 1.25 * half
    exemplar, extent = Square(-half, -half, ground.EXEMPLAR), Extent(-reach, -reach, reach, reach)
    return SceneFrame("synthetic", "metre", FLYING_HEIGHT, exemplar, extent)


def _sky(rng: np.random.Generator, sun: light.Light) -> Sky:
    blue = np.clip((sun.sun.mean() * sun.towards[2]) / 0.9, 0, 1)
    cloudy = np.full(3, rng.uniform(0.6, 0.95))
    zenith = cloudy + blue * (np.array([0.25, 0.45, 0.8]) * rng.uniform(0.8, 1.2) - cloudy)
    horizon = cloudy + blue * (np.array([0.75, 0.84, 0.93]) * rng.uniform(0.9, 1.05) - cloudy)
    return Sky(*(np.clip(c + rng.normal(0, 0.03, 3), 0, 1) for c in (zenith, horizon)))
