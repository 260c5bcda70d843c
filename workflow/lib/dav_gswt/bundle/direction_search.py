"""How many orders a tile set needs: directions are added until drawing in a neighbour's order is not seen."""

import logging
from dataclasses import dataclass

import numpy as np

from dav_gswt.bundle import order_directions
from dav_gswt.bundle.chunks import size_of
from dav_gswt.bundle.order_directions import Sight
from dav_gswt.bundle.orders import Rings
from dav_gswt.field import GaussianField
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet

_log = logging.getLogger(__name__)

MOST = 33  # orders of a tile that is not deep: with its record, 82 bytes a Gaussian
FEWEST = 4  # azimuths
AZIMUTHS = (4, 8, 16, 32, 64)  # of the table


@dataclass(frozen=True)
class Measured:
    """Directions, and the PSNR of the finest level drawn in the order of the nearest one that a tile keeps which is not
    deep, by elevation (`sights.ELEVATIONS`), where that is worst: half-way between two azimuths. None: no difference.
    """

    rings: Rings
    decibels: dict[str, float | None]


def climbed(fields: list[GaussianField], side: float, wanted: float, most: int = MOST) -> Measured:
    """The fewest directions with which no sight is below `wanted` decibels, or as many as `most` allow.

    Begins with a ring of FEWEST azimuths 20 degrees down, as walkers look at the ground around. Where the worst sight
    is below, it is looked at along the kept azimuths alone: if the elevation is to blame for most of the error, a ring
    is added at that elevation, else every ring has twice the azimuths. Views from above 45 degrees are not looked at:
    steep sights are of the tiles about the eye, which are sorted exactly.
    Args: fields: of the finest level; coarser ones begin where one of their discs covers a pixel.
    """
    elevations, kept = (20.0,), FEWEST
    while True:
        found = Measured(Rings(elevations, 2 * kept), by_elevation(fields, side, elevations, kept))
        worst = min(found.decibels, key=lambda view: _of(found.decibels[view]))
        if _of(found.decibels[worst]) >= wanted:
            return found
        down, above = order_directions.ELEVATIONS[worst], 3.0 + _of(found.decibels[worst])  # 3 dB: half of the error
        taller = tuple(sorted({*elevations, down}))
        missing = taller != elevations and _of(in_between(fields, side, elevations, kept, down, halfway=False)) < above
        more = (taller, kept) if missing else (elevations, 2 * kept)
        if len(more[0]) * more[1] + 1 > most:
            _log.warning("orders: %.1f dB with %d directions, and no room for more", _of(found.decibels[worst]), most)
            return found
        elevations, kept = more


def by_elevation(
    fields: list[GaussianField], side: float, elevations: tuple[float, ...], kept: int
) -> dict[str, float | None]:
    """The PSNR half-way between azimuths, at the elevations looked at."""
    return {
        view: in_between(fields, side, elevations, kept, down) for view, down in order_directions.ELEVATIONS.items()
    }


def rows(tiles: TileSet, wanted: float) -> list[dict]:
    """One row a tile and number of azimuths, at the elevations that the set needs: what more orders are worth.

    `doubtful`: of the half of the tiles that are most in doubt. `orders`, `bytes` a Gaussian with its record.
    `{view}_db`: PSNR half-way between azimuths against the exact order; None: no difference.
    """
    elevations = climbed(tiles.fields[0], tiles.side, wanted).rings.elevations
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
                "bytes": size_of(len(field), count) / len(field),
            }
            errors = by_elevation([field], tiles.side, elevations, azimuths)
            found.append(told | {f"{view}_db": value for view, value in errors.items()})
    return found


def in_between(
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
    along = Rings(elevations, kept).directions()
    pairs = []
    for sight in order_directions.spread(len(fields), down, kept):
        seen = sight if halfway else Sight(sight.tile, sight.azimuth - 180 / kept, down)
        pairs.append(in_two_orders(fields[seen.tile], side, seen, along))
    return order_directions.decibels(pairs)


def in_two_orders(field: GaussianField, side: float, sight: Sight, along) -> tuple:
    """A sight in the order of the nearest of some directions, and in its own."""
    direction, pixel = sight.direction, order_directions.nearest_pixel(side)
    best = along[int(np.argmax(along @ direction))]
    exact = order_directions.drawn(field, side, direction, pixel)
    same = np.array_equal(best, direction)
    return (exact if same else order_directions.drawn(field, side, direction, pixel, best)), exact


def _of(decibels: float | None) -> float:
    return np.inf if decibels is None else decibels
