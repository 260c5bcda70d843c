"""Renders of tiles by parallel projection, in a given order: the error of pre-sorted orders and of rounding.

A parallel projection does not change when a Gaussian moves along the viewing direction. So the rasterizer, which sorts
by depth, draws any order if each Gaussian is moved to the depth of its place in it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle import level_distances, orders
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images.metrics import mse_to_psnr
from dav_gswt.raster import make_rasterizer, to_raster_arrays

ELEVATIONS = {"walker": float(np.degrees(np.arcsin(0.1))), "oblique": 45.0}  # a walker's eye: a tenth of the distance
WIDTH, HEIGHT = 256, 128  # pixels about the tile's middle
VIEWS = 8  # at each elevation


@dataclass(frozen=True)
class TileView:
    """A tile's number, and from where it is looked at: degrees from the east, degrees below the horizon."""

    tile: int
    azimuth: float
    elevation: float

    @property
    def direction(self) -> Float[Array, "3"]:
        return orders.unit_vectors(np.radians([self.azimuth]), np.radians(self.elevation))[0]


def spread_views(tiles: int, elevation: float, azimuths: int = 1) -> list[TileView]:
    """VIEWS views of different tiles, evenly around, each half-way between two of so many azimuths."""
    around = [round(azimuths * k / VIEWS) + 0.5 for k in range(VIEWS)]
    return [TileView(5 * k % tiles, 360 / azimuths * a % 360, elevation) for k, a in enumerate(around)]


def pixel_size(side: float) -> float:
    """What a pixel of the reference picture covers a tile's side away: nearer tiles are sorted exactly."""
    return side / level_distances.FOCAL


def render_in_order(
    field: GaussianField, side: float, along: Float[Array, "3"], pixel: float, order: Float[Array, "3"] | None = None
) -> Float32[Array, "h w 3"]:
    """The middle of a tile seen along a direction, in the order of another one, pixels `pixel` wide; black behind."""
    middle = np.array([side / 2, side / 2, np.median(field.means[:, 2])])
    camera = _make_camera(along, pixel)
    field = field[_find_visible(field, middle, camera)]
    means = field.means.astype(float) - middle
    place = np.empty(len(field))
    place[orders.sort_back_to_front(field.means, along if order is None else order)] = np.arange(len(field), 0, -1)
    depth = side * (1 + place / max(len(field), 1))
    means += (depth - means @ along)[:, None] * along
    moved = replace(field, means=means.astype(np.float32))
    return make_rasterizer(near=1e-6).forward(**to_raster_arrays(moved), camera=camera).colour


def _find_visible(field: GaussianField, middle: Float[Array, "3"], camera: Camera) -> Bool[Array, "n"]:
    """Which Gaussians overlap the picture with four standard deviations about their centres."""
    x, y, z = (field.means - middle.astype(np.float32)).T
    a, b, c = field.log_scales.T
    radius, visible = 4 * np.exp(np.maximum(np.maximum(a, b), c)), np.ones(len(field), bool)
    for axis, half in zip(camera.rotation.astype(np.float32), (WIDTH, HEIGHT), strict=False):
        visible &= np.abs(x * axis[0] + y * axis[1] + z * axis[2]) - radius < 0.5 * half / np.float32(camera.fx)
    return visible


def compute_psnr(pairs: list[tuple[Float32[Array, "h w 3"], Float32[Array, "h w 3"]]]) -> float | None:
    """PSNR of pictures against others, over all pixels of all; None: they are equal."""
    square = float(np.mean([((a.astype(float) - b) ** 2).mean() for a, b in pairs]))
    return mse_to_psnr(square)


def _make_camera(along: Float[Array, "3"], pixel: float) -> Camera:
    right = np.cross(along, [0.0, 0.0, 1.0])
    length = np.linalg.norm(right)
    right = right / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
    turn = np.stack([right, np.cross(along, right), along])
    return Camera(turn, np.zeros(3), 1 / pixel, 1 / pixel, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT, True)
