"""What more pre-sorted orders are worth: pictures of tiles drawn in a neighbouring direction's order."""

import numpy as np

from dav_gswt.bundle.chunks import chunk_size
from dav_gswt.bundle.direction_search import measure_elevations, search_directions
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet

AZIMUTHS = (4, 8, 16, 32, 64)


def measure_orders(tiles: TileSet, wanted: float) -> list[dict]:
    """One row a tile and number of azimuths, at the elevations that the set needs.

    `uncertain`: of the half of the tiles that is more uncertain. `orders`, `bytes` a Gaussian with its record.
    `{view}_db`: PSNR half-way between azimuths against the exact order; None: no difference.
    """
    elevations = search_directions(tiles.fields[0], tiles.side, wanted)[0].elevations
    rank, found = np.argsort(np.argsort(-tiles.uncertainty, kind="stable")), []
    for tile, field in enumerate(progress(tiles.fields[0], "measure orders")):
        for azimuths in AZIMUTHS:
            count = len(elevations) * azimuths + 1
            row = {
                "tile": tile,
                "uncertainty": float(tiles.uncertainty[tile]),
                "uncertain": int(rank[tile] < len(rank) // 2),
                "azimuths": azimuths,
                "orders": count,
                "bytes": chunk_size(len(field), count) / len(field),
            }
            errors = measure_elevations([field], tiles.side, elevations, azimuths)
            found.append(row | {f"{view}_db": value for view, value in errors.items()})
    return found
