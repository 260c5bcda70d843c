"""Orders: the splats of a tile from back to front, for a few viewing directions.

A viewer draws a tile in the order whose direction is nearest to its own. It sorts each order once, when it first needs
it, and keeps it. How many directions a wanted PSNR takes is measured (`search_directions`). Uncertain tiles, those from
tau on, use all azimuths, the others every second one (the paper's "uncertainty-guided caching"); `measure_orders` says
what tau buys and costs.

To measure, tiles are rendered by parallel projection in a given order. A parallel projection does not change when a
Gaussian moves along the viewing direction. So the rasterizer, which sorts by depth, draws any order if each Gaussian is
moved to the depth of its place in it.
"""

import logging
import time
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, UInt32
from numpy import ndarray as Array

from dav_gswt.bundle import manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images.metrics import mse_to_psnr
from dav_gswt.logs import progress
from dav_gswt.raster import make_rasterizer, to_raster_arrays

_log = logging.getLogger(__name__)
MAX_ORDERS = 33  # of a tile that keeps every second azimuth: with its record, 82 bytes a Gaussian
MIN_AZIMUTHS = 4
DECIBELS = 40.0  # PSNR from which drawing in a neighbour's order counts as invisible
ELEVATIONS = {"walker": float(np.degrees(np.arcsin(0.1))), "oblique": 45.0}  # a walker's eye: a tenth of the distance
WIDTH, HEIGHT = 256, 128  # pixels about the tile's middle
VIEWS = 8  # at each elevation
Picture = Float32[Array, "h w 3"]
MEGA = 1e6
INDEX = 4  # bytes of an entry of an order in a viewer


@dataclass(frozen=True)
class DirectionRings:
    """Viewing directions: rings of `azimuths` each, at elevations in degrees below the horizon, and straight down.

    Only uncertain tiles keep all; the others keep every second azimuth.
    """

    elevations: tuple[float, ...] = (20.0,)
    azimuths: int = 16

    def directions(self) -> Float[Array, "d 3"]:
        """Unit vectors, ring after ring, each from the east to the north; straight down comes last."""
        azimuth = 2 * np.pi * np.arange(self.azimuths) / self.azimuths
        rings = [unit_vectors(azimuth, np.radians(down)) for down in self.elevations]
        return np.concatenate([*rings, [[0.0, 0.0, -1.0]]])

    def select_directions(self, uncertainty: float, tau: float) -> list[int]:
        """Indices into directions() that a tile keeps: all if it is uncertain, else every second azimuth.

        Straight down is always kept: of n azimuths on r rings r n + 1 directions or r n / 2 + 1. A tile is uncertain if
        u >= tau and tau < 1: at tau = 0 every tile is, at tau = 1 none, and a larger tau never adds one.
        """
        step = 1 if uncertainty >= tau and tau < 1 else 2
        last = self.azimuths * len(self.elevations)
        return [*(r + k for r in range(0, last, self.azimuths) for k in range(0, self.azimuths, step)), last]


def unit_vectors(azimuth: Float[Array, "n"], down: float) -> Float[Array, "n 3"]:
    """Unit vectors at azimuths from the east to the north, so far below the horizon; in radians."""
    flat = np.stack([np.cos(azimuth), np.sin(azimuth)], 1) * np.cos(down)
    return np.concatenate([flat, np.full((len(azimuth), 1), -np.sin(down))], 1)


def sort_back_to_front(means: Float32[Array, "n 3"], along: Float[Array, "3"]) -> UInt32[Array, "n"]:
    """Indices by falling depth along a viewing direction; of equal depths the smaller index comes first."""
    return np.argsort(-(means.astype(float) @ along), kind="stable").astype(np.uint32)


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
    pixel = side / manifest.FOCAL  # of the reference picture a tile's side away: nearer tiles are sorted exactly
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
    place[sort_back_to_front(field.means, along if order is None else order)] = np.arange(len(field), 0, -1)
    depth = side * (1 + place / max(len(field), 1))
    means += (depth - means @ along)[:, None] * along
    moved = replace(field, means=means.astype(np.float32))
    return make_rasterizer(near=1e-6).forward(**to_raster_arrays(moved), camera=camera).colour


def compute_psnr(pairs: list[tuple[Picture, Picture]]) -> float | None:
    """PSNR of pictures against others, over all pixels of all; None: they are equal."""
    return mse_to_psnr(float(np.mean([((a.astype(float) - b) ** 2).mean() for a, b in pairs])))


def measure_orders(bundle: Bundle) -> dict[str, float | int | None]:
    """Measure the orders of a bundle's tiles.

    Returns: `orders`, number of all tiles' at all levels; `order_mb`, memory of a viewer that keeps them all;
    `order_db`, PSNR of views of the finest level, drawn in the order of the nearest direction against their own, None
    where they are equal; `compose_s` and `sort_s`, CPU seconds of composing all tiles at all levels and of sorting
    them for all their directions, on one core.
    Raises: InputError: see `Bundle.chunk`.
    """
    tiles, along = bundle.manifest.tiles, np.array(bundle.manifest.directions)
    start = time.process_time()
    fields = bundle.fields()
    composed = time.process_time() - start
    start = time.process_time()
    for tile in progress(tiles, "sort tiles"):
        for level in fields:
            for direction in tile.orders:
                sort_back_to_front(level[tile.tile].means, along[direction])
    spent = time.process_time() - start
    return {
        "orders": sum(len(tile.orders) * len(tile.chunks) for tile in tiles),
        "order_mb": sum(INDEX * len(tile.orders) * chunk.count for tile in tiles for chunk in tile.chunks) / MEGA,
        "order_db": _measure_error(bundle, fields[0]),
        "compose_s": composed,
        "sort_s": spent,
    }


def _measure_error(bundle: Bundle, fields: list) -> float | None:
    """PSNR of every tile, seen once at each elevation, in the order of the nearest of its directions."""
    tiles, side, pairs = bundle.manifest.tiles, bundle.manifest.tile_side, []
    along, pixel = np.array(bundle.manifest.directions), side / manifest.FOCAL
    for number, down in enumerate(ELEVATIONS.values()):
        # azimuths in the golden angle: of all directions each tile meets others
        azimuths = (np.arange(len(tiles)) + number * len(tiles)) * np.pi * (3 - 5**0.5)
        for tile, direction in zip(tiles, unit_vectors(azimuths, np.radians(down)), strict=True):
            kept = along[tile.orders]
            best, field = kept[int(np.argmax(kept @ direction))], fields[tile.tile]
            exact = render_in_order(field, side, direction, pixel)
            pairs.append((render_in_order(field, side, direction, pixel, best), exact))
    return compute_psnr(pairs)
