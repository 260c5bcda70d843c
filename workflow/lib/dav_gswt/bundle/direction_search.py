"""Search for the fewest pre-sorted orders of a tile set with which pictures reach a wanted PSNR.

Tiles are rendered by parallel projection in a given order. A parallel projection does not change when a
Gaussian moves along the viewing direction. So the rasterizer, which sorts by depth, draws any order if each
Gaussian is moved to the depth of its place in it.
"""

import logging
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle import level_distances, orders
from dav_gswt.bundle.orders import DirectionRings, unit_vectors
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images.metrics import mse_to_psnr
from dav_gswt.raster import make_rasterizer, to_raster_arrays

_log = logging.getLogger(__name__)

MAX_ORDERS = 33  # of a tile that keeps every second azimuth: with its record, 82 bytes a Gaussian
MIN_AZIMUTHS = 4
DECIBELS = 40.0  # PSNR from which drawing in a neighbour's order counts as invisible
ELEVATIONS = {"walker": float(np.degrees(np.arcsin(0.1))), "oblique": 45.0}  # a walker's eye: a tenth of the distance
WIDTH, HEIGHT = 256, 128  # pixels about the tile's middle
VIEWS = 8  # at each elevation

Picture = Float32[Array, "h w 3"]


def search_directions(fields: list[GaussianField], side: float, wanted: float = DECIBELS) -> DirectionRings:
    """The fewest directions with which every view reaches `wanted` decibels, or as many as MAX_ORDERS allow.

    The search starts with a ring of MIN_AZIMUTHS azimuths 20 degrees below the horizon. While the worst
    view is below `wanted`, it is compared with views along the kept azimuths: if the elevation causes most
    of the error, a ring at that elevation is added, otherwise every ring gets twice the azimuths. Views
    steeper than 45 degrees are left out: they show the tiles about the eye, which are sorted exactly.

    Args:
        fields: the tiles of the finest level; a coarser level is used only where its discs cover a pixel.
    Returns: the directions, of which such a tile keeps every second azimuth.
    """
    elevations, kept = (20.0,), MIN_AZIMUTHS
    while True:
        rings = DirectionRings(elevations, kept)
        decibels, worst = min((measure_psnr(fields, side, rings, down), view) for view, down in ELEVATIONS.items())
        if decibels >= wanted:
            break
        elevation = ELEVATIONS[worst]
        more = tuple(sorted({*elevations, elevation}))
        along_azimuths = measure_psnr(fields, side, rings, elevation, halfway=False)
        missing = more != elevations and along_azimuths < decibels + 3.0  # half of the error is 3 dB
        elevations_next, kept_next = (more, kept) if missing else (elevations, 2 * kept)
        if len(elevations_next) * kept_next + 1 > MAX_ORDERS:
            _log.info("orders: %.1f dB with %d directions, and no room for more", decibels, MAX_ORDERS)
            break
        elevations, kept = elevations_next, kept_next
    return DirectionRings(elevations, 2 * kept)


def measure_psnr(
    fields: list[GaussianField], side: float, rings: DirectionRings, elevation: float, halfway: bool = True
) -> float:
    """PSNR of VIEWS views of different tiles, drawn in the order of the nearest direction, against their own order.

    The views lie evenly around at an elevation in degrees below the horizon. halfway: half-way between two azimuths,
    where an order is worst; otherwise along an azimuth. Infinite: no difference.
    """
    pixel = side / level_distances.FOCAL  # of the reference picture a tile's side away: nearer tiles are sorted exactly
    along, pairs = rings.directions(), []
    for k in range(VIEWS):
        azimuth = 360 / rings.azimuths * (round(rings.azimuths * k / VIEWS) + 0.5) % 360
        azimuth -= 0 if halfway else 180 / rings.azimuths
        field, direction = fields[5 * k % len(fields)], unit_vectors(np.radians([azimuth]), np.radians(elevation))[0]
        best = along[int(np.argmax(along @ direction))]
        exact = render_in_order(field, side, direction, pixel)
        pairs.append((render_in_order(field, side, direction, pixel, best), exact))
    decibels = compute_psnr(pairs)
    return np.inf if decibels is None else decibels


def render_in_order(
    field: GaussianField, side: float, along: Float[Array, "3"], pixel: float, order: Float[Array, "3"] | None = None
) -> Picture:
    """The middle of a tile seen along a direction, in the order of another one, pixels `pixel` wide; black behind."""
    middle = np.array([side / 2, side / 2, np.median(field.means[:, 2])])
    right = np.cross(along, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(along, right), along])
    camera = Camera(turn, np.zeros(3), 1 / pixel, 1 / pixel, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT, True)
    # four standard deviations about their centres overlap the picture
    x, y, z = (field.means - middle.astype(np.float32)).T
    radius, visible = 4 * np.exp(field.log_scales.max(1)), np.ones(len(field), bool)
    for axis, half in zip(turn.astype(np.float32), (WIDTH, HEIGHT), strict=False):
        visible &= np.abs(x * axis[0] + y * axis[1] + z * axis[2]) - radius < 0.5 * half / np.float32(camera.fx)
    field = field[visible]
    means = field.means.astype(float) - middle
    place = np.empty(len(field))
    place[orders.sort_back_to_front(field.means, along if order is None else order)] = np.arange(len(field), 0, -1)
    depth = side * (1 + place / max(len(field), 1))
    means += (depth - means @ along)[:, None] * along
    moved = replace(field, means=means.astype(np.float32))
    return make_rasterizer(near=1e-6).forward(**to_raster_arrays(moved), camera=camera).colour


def compute_psnr(pairs: list[tuple[Picture, Picture]]) -> float | None:
    """PSNR of pictures against others, over all pixels of all; None: they are equal."""
    return mse_to_psnr(float(np.mean([((a.astype(float) - b) ** 2).mean() for a, b in pairs])))
