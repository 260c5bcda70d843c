"""Search for the fewest pre-sorted orders of a tile set with which pictures reach a wanted PSNR."""

import logging
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle import order_directions
from dav_gswt.bundle.order_directions import TileView
from dav_gswt.bundle.orders import DirectionRings
from dav_gswt.field import GaussianField

_log = logging.getLogger(__name__)

MAX_ORDERS = 33  # of a tile that keeps every second azimuth: with its record, 82 bytes a Gaussian
MIN_AZIMUTHS = 4


@dataclass(frozen=True)
class DirectionSearchResult:
    """Directions, and the PSNR of pictures drawn in their orders.

    Attributes:
        rings: the directions.
        decibels: by elevation (`order_directions.ELEVATIONS`), the PSNR of the finest level drawn in the order of the
            nearest direction that a tile with every second azimuth keeps, half-way between two of these azimuths, where
            it is worst. None: no difference.
    """

    rings: DirectionRings
    decibels: dict[str, float | None]


def search_directions(
    fields: list[GaussianField], side: float, wanted: float, most: int = MAX_ORDERS
) -> DirectionSearchResult:
    """The fewest directions with which every view reaches `wanted` decibels, or as many as `most` allow.

    Starts with a ring of MIN_AZIMUTHS azimuths 20 degrees below the horizon. While the worst view is below `wanted`, it
    is compared with views along the kept azimuths: if the elevation causes most of the error, a ring at that elevation
    is added, otherwise every ring gets twice the azimuths. Views steeper than 45 degrees are left out: they are of the
    tiles about the eye, which are sorted exactly.

    Args: fields: the tiles of the finest level; a coarser level is used only where its discs cover a pixel.
    """
    elevations, kept = (20.0,), MIN_AZIMUTHS
    while True:
        found = DirectionSearchResult(
            DirectionRings(elevations, 2 * kept), measure_elevations(fields, side, elevations, kept)
        )
        worst = min(found.decibels, key=lambda view: _as_number(found.decibels[view]))
        if _as_number(found.decibels[worst]) >= wanted:
            return found
        elevation = order_directions.ELEVATIONS[worst]
        half = 3.0 + _as_number(found.decibels[worst])  # of the error is 3 dB
        more = tuple(sorted({*elevations, elevation}))
        along_azimuths = DirectionRings(elevations, kept)
        missing = more != elevations and (
            _as_number(measure_psnr(fields, side, along_azimuths, elevation, halfway=False)) < half
        )
        elevations_next, kept_next = (more, kept) if missing else (elevations, 2 * kept)
        if len(elevations_next) * kept_next + 1 > most:
            decibels = _as_number(found.decibels[worst])
            _log.warning("orders: %.1f dB with %d directions, and no room for more", decibels, most)
            return found
        elevations, kept = elevations_next, kept_next


def measure_elevations(
    fields: list[GaussianField], side: float, elevations: tuple[float, ...], kept: int
) -> dict[str, float | None]:
    """`measure_psnr` at each of `order_directions.ELEVATIONS`, for rings of `kept` azimuths at `elevations`."""
    rings = DirectionRings(elevations, kept)
    return {view: measure_psnr(fields, side, rings, down) for view, down in order_directions.ELEVATIONS.items()}


def measure_psnr(
    fields: list[GaussianField], side: float, rings: DirectionRings, elevation: float, halfway: bool = True
) -> float | None:
    """PSNR of views at one elevation, drawn in the order of the nearest direction, against their own order.

    Args: halfway: views lie half-way between two azimuths, where an order is worst; otherwise along an azimuth.
    """
    along, pairs = rings.directions(), []
    for view in order_directions.spread_views(len(fields), elevation, rings.azimuths):
        seen = view if halfway else TileView(view.tile, view.azimuth - 180 / rings.azimuths, elevation)
        pairs.append(render_in_two_orders(fields[seen.tile], side, seen, along))
    return order_directions.compute_psnr(pairs)


def render_in_two_orders(
    field: GaussianField, side: float, view: TileView, along: Float[Array, "d 3"]
) -> tuple[Float32[Array, "h w 3"], Float32[Array, "h w 3"]]:
    """A view drawn in the order of the nearest of some directions, and in its own."""
    direction, pixel = view.direction, order_directions.pixel_size(side)
    best = along[int(np.argmax(along @ direction))]
    exact = order_directions.render_in_order(field, side, direction, pixel)
    same = np.array_equal(best, direction)
    return (exact if same else order_directions.render_in_order(field, side, direction, pixel, best)), exact


def _as_number(decibels: float | None) -> float:
    return np.inf if decibels is None else decibels
