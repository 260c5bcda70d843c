"""How many orders a tile set needs: directions are added until drawing in a neighbour's order is not seen."""

import logging
from dataclasses import dataclass

import numpy as np

from dav_gswt.bundle import order_directions
from dav_gswt.bundle.chunks import chunk_size
from dav_gswt.bundle.order_directions import TileView
from dav_gswt.bundle.orders import DirectionRings
from dav_gswt.field import GaussianField
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet

_log = logging.getLogger(__name__)

MAX_ORDERS = 33  # orders of a tile that is not deep: with its record, 82 bytes a Gaussian
MIN_AZIMUTHS = 4  # azimuths
AZIMUTHS = (4, 8, 16, 32, 64)  # of the table


@dataclass(frozen=True)
class DirectionSearchResult:
    """Directions, and the PSNR of the finest level drawn in the order of the nearest one that a tile keeps which is not
    deep, by elevation (`sights.ELEVATIONS`), where that is worst: half-way between two azimuths. None: no difference.
    """

    rings: DirectionRings
    decibels: dict[str, float | None]


def search_directions(
    fields: list[GaussianField], side: float, wanted: float, most: int = MAX_ORDERS
) -> DirectionSearchResult:
    """The fewest directions with which no sight is below `wanted` decibels, or as many as `most` allow.

    Begins with a ring of FEWEST azimuths 20 degrees down, as walkers look at the ground around. Where the worst sight
    is below, it is looked at along the kept azimuths alone: if the elevation is to blame for most of the error, a ring
    is added at that elevation, else every ring has twice the azimuths. Views from above 45 degrees are not looked at:
    steep sights are of the tiles about the eye, which are sorted exactly.
    Args: fields: of the finest level; coarser ones begin where one of their discs covers a pixel.
    """
    elevations, kept = (20.0,), MIN_AZIMUTHS
    while True:
        found = DirectionSearchResult(
            DirectionRings(elevations, 2 * kept), measure_elevations(fields, side, elevations, kept)
        )
        worst = min(found.decibels, key=lambda view: _as_number(found.decibels[view]))
        if _as_number(found.decibels[worst]) >= wanted:
            return found
        down, above = (
            order_directions.ELEVATIONS[worst],
            3.0 + _as_number(found.decibels[worst]),
        )  # 3 dB: half of the error
        taller = tuple(sorted({*elevations, down}))
        missing = (
            taller != elevations
            and _as_number(measure_between_azimuths(fields, side, elevations, kept, down, halfway=False)) < above
        )
        more = (taller, kept) if missing else (elevations, 2 * kept)
        if len(more[0]) * more[1] + 1 > most:
            _log.warning(
                "orders: %.1f dB with %d directions, and no room for more", _as_number(found.decibels[worst]), most
            )
            return found
        elevations, kept = more


def measure_elevations(
    fields: list[GaussianField], side: float, elevations: tuple[float, ...], kept: int
) -> dict[str, float | None]:
    """The PSNR half-way between azimuths, at the elevations looked at."""
    return {
        view: measure_between_azimuths(fields, side, elevations, kept, down)
        for view, down in order_directions.ELEVATIONS.items()
    }


def measure_orders(tiles: TileSet, wanted: float) -> list[dict]:
    """One row a tile and number of azimuths, at the elevations that the set needs: what more orders are worth.

    `doubtful`: of the half of the tiles that are most in doubt. `orders`, `bytes` a Gaussian with its record.
    `{view}_db`: PSNR half-way between azimuths against the exact order; None: no difference.
    """
    elevations = search_directions(tiles.fields[0], tiles.side, wanted).rings.elevations
    doubt, found = np.argsort(np.argsort(-tiles.uncertainty, kind="stable")), []
    for tile, field in enumerate(progress(tiles.fields[0], "measure orders")):
        for azimuths in AZIMUTHS:
            count = len(elevations) * azimuths + 1
            told = {
                "tile": tile,
                "uncertainty": float(tiles.uncertainty[tile]),
                "doubtful": int(doubt[tile] < len(doubt) // 2),
                "azimuths": azimuths,
                "orders": count,
                "bytes": chunk_size(len(field), count) / len(field),
            }
            errors = measure_elevations([field], tiles.side, elevations, azimuths)
            found.append(told | {f"{view}_db": value for view, value in errors.items()})
    return found


def measure_between_azimuths(
    fields: list[GaussianField],
    side: float,
    elevations: tuple[float, ...],
    kept: int,
    down: float,
    halfway: bool = True,
) -> float | None:
    """PSNR over sights at one elevation, drawn in the order of the nearest direction against their own.

    halfway: between two azimuths, else along the kept ones: then only the elevation errs.
    """
    along = DirectionRings(elevations, kept).directions()
    pairs = []
    for sight in order_directions.spread_views(len(fields), down, kept):
        seen = sight if halfway else TileView(sight.tile, sight.azimuth - 180 / kept, down)
        pairs.append(render_in_two_orders(fields[seen.tile], side, seen, along))
    return order_directions.compute_psnr(pairs)


def render_in_two_orders(field: GaussianField, side: float, sight: TileView, along) -> tuple:
    """A sight in the order of the nearest of some directions, and in its own."""
    direction, pixel = sight.direction, order_directions.pixel_size(side)
    best = along[int(np.argmax(along @ direction))]
    exact = order_directions.render_in_order(field, side, direction, pixel)
    same = np.array_equal(best, direction)
    return (exact if same else order_directions.render_in_order(field, side, direction, pixel, best)), exact


def _as_number(decibels: float | None) -> float:
    return np.inf if decibels is None else decibels
