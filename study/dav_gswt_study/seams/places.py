"""Places of crops: points on the borders between tiles, and on the cuts inside tiles."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from dav_gswt.tiles import layout
from dav_gswt.tiles.layout import CENTRE, LABELS
from dav_gswt_study.seams.placed_tiles import PlacedTiles

BIN = 12  # cells along a seam that count as one place of it


@dataclass(frozen=True)
class Place:
    """A point of the ground, in finest cells. cluster: the part of the seam, the same in all its copies."""

    at: tuple[int, int]
    cluster: str


def sample_borders(placed: PlacedTiles, rng: np.random.Generator) -> list[Place]:
    """Points on borders, away from the corner patches, in random order."""
    n, a, size = placed.plan.side, placed.plan.corner, len(placed.patch)
    places = []
    for upright in (True, False):
        for edge in range(n, size, n):
            for along in range(0, size):
                if a <= along % n < n - a:
                    x, y = (edge, along) if upright else (along, edge)
                    west, _, _, south = layout.edge_colours(int(placed.tile[y, x]) % layout.EDGES)
                    name = f"v{west}" if upright else f"h{south}"
                    places.append(Place((x + placed.first, y + placed.first), f"{name}:{along % n // BIN}"))
    return _shuffle(places, rng)


def sample_cuts(placed: PlacedTiles, rng: np.random.Generator) -> list[Place]:
    """Random points where patches meet inside tiles: one of each cluster before any has a second.

    Clusters are ordered by a digest of their names, so other cuts of the same tiles are compared in the same places.
    """
    n, places = placed.plan.side, []
    for x, y, centre in placed.corners.tolist():
        tile = int(placed.tile[y, x])
        if centre:
            name = f"t{tile}:{x % n // BIN}:{y % n // BIN}"
        else:  # of a strip against its corner: the same in every tile that has the strip
            labels = placed.label[y - 1 : y + 1, x - 1 : x + 1].ravel()
            side = LABELS[min(v for v in labels if v != CENTRE)]
            colour = dict(zip("WNES", layout.edge_colours(tile % layout.EDGES), strict=True)).get(side, 0)
            name = f"{'v' if side in 'WE' else 'h'}{colour}:{'start' if min(x % n, y % n) < n // 2 else 'end'}"
        places.append(Place((x + placed.first, y + placed.first), name))
    turn: dict[str, int] = {}
    rounds = []
    for place in (drawn := _shuffle(places, rng)):
        turn[place.cluster] = turn.get(place.cluster, 0) + 1
        rounds.append((turn[place.cluster], crc32(place.cluster.encode())))
    return [drawn[k] for k in sorted(range(len(drawn)), key=rounds.__getitem__)]


def find_nearest_cut(placed: PlacedTiles, place: Place) -> Place | None:
    """The cut of a tile set that is nearest to a place of another one, in the same tile and of the same kind."""
    x, y = place.at[0] - placed.first, place.at[1] - placed.first
    corners, n = placed.corners, placed.plan.side
    kind = place.cluster.startswith("t")
    same_tile = corners[(corners[:, 0] // n == x // n) & (corners[:, 1] // n == y // n) & (corners[:, 2] == kind)]
    if not len(same_tile):
        return None
    best = same_tile[((same_tile[:, :2] - [x, y]) ** 2).sum(1).argmin()]
    return Place((int(best[0]) + placed.first, int(best[1]) + placed.first), place.cluster)


def _shuffle(places: list[Place], rng: np.random.Generator) -> list[Place]:
    return [places[k] for k in rng.permutation(len(places))]
