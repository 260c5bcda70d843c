"""What tau buys and costs: the orders that the tiles of a bundle are drawn in, beside exact sorting.

A viewer composes a tile when it first sees it, and sorts it once for each direction that it needs. Tiles from tau on
have all directions, the others every second azimuth (`orders.DirectionRings`).
"""

import time

import numpy as np

from dav_gswt.bundle import direction_search, level_distances
from dav_gswt.bundle.orders import sort_back_to_front, unit_vectors
from dav_gswt.bundle.store import Bundle
from dav_gswt.logs import progress

MEGA = 1e6
INDEX = 4  # bytes of an entry of an order in a viewer


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
    along, pixel = np.array(bundle.manifest.directions), side / level_distances.FOCAL
    for number, down in enumerate(direction_search.ELEVATIONS.values()):
        # azimuths in the golden angle: of all directions each tile meets others
        azimuths = (np.arange(len(tiles)) + number * len(tiles)) * np.pi * (3 - 5**0.5)
        for tile, direction in zip(tiles, unit_vectors(azimuths, np.radians(down)), strict=True):
            kept = along[tile.orders]
            best, field = kept[int(np.argmax(kept @ direction))], fields[tile.tile]
            exact = direction_search.render_in_order(field, side, direction, pixel)
            pairs.append((direction_search.render_in_order(field, side, direction, pixel, best), exact))
    return direction_search.compute_psnr(pairs)
