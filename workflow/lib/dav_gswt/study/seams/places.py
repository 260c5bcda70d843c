"""Where crops are taken: points on the borders between tiles, on the cuts inside them, and on cuts beside these."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from dav_gswt.study.seams.ground import Laid
from dav_gswt.tiles import layout
from dav_gswt.tiles.layout import CENTRE, LABELS

BIN = 12  # cells along a seam that count as one place of it


@dataclass(frozen=True)
class Place:
    """A point of the ground, in finest cells; cluster: what of the seam it shows, the same wherever that is laid."""

    at: tuple[int, int]
    cluster: str


def borders(laid: Laid, rng: np.random.Generator) -> list[Place]:
    """Points on borders, away from the corners' patches, in an order drawn at random."""
    n, a, size = laid.plan.side, laid.plan.corner, len(laid.patch)
    found = []
    for upright in (True, False):
        for edge in range(n, size, n):
            for along in range(0, size):
                if a <= along % n < n - a:
                    x, y = (edge, along) if upright else (along, edge)
                    west, _, _, south = layout.edge_colours(int(laid.tile[y, x]) % layout.EDGES)
                    name = f"v{west}" if upright else f"h{south}"
                    found.append(Place((x + laid.first, y + laid.first), f"{name}:{along % n // BIN}"))
    return _shuffled(found, rng)


def cuts(laid: Laid, rng: np.random.Generator) -> list[Place]:
    """Points where patches meet inside tiles, drawn at random: one of each cluster before any has a second.

    The order of the clusters is by a digest of their names: other cuts of the same tiles are looked at in the same
    places.
    """
    n, found = laid.plan.side, []
    for x, y, centre in laid.corners.tolist():
        tile = int(laid.tile[y, x])
        if centre:
            name = f"t{tile}:{x % n // BIN}:{y % n // BIN}"
        else:  # of a strip against its corner: the same in every tile that has the strip
            labels = laid.label[y - 1 : y + 1, x - 1 : x + 1].ravel()
            side = LABELS[min(v for v in labels if v != CENTRE)]
            colour = dict(zip("WNES", layout.edge_colours(tile % layout.EDGES), strict=True)).get(side, 0)
            name = f"{'v' if side in 'WE' else 'h'}{colour}:{'start' if min(x % n, y % n) < n // 2 else 'end'}"
        found.append(Place((x + laid.first, y + laid.first), name))
    turn: dict[str, int] = {}
    rounds = []
    for place in (drawn := _shuffled(found, rng)):
        turn[place.cluster] = turn.get(place.cluster, 0) + 1
        rounds.append((turn[place.cluster], crc32(place.cluster.encode())))
    return [drawn[k] for k in sorted(range(len(drawn)), key=rounds.__getitem__)]


def beside(laid: Laid, place: Place) -> Place | None:
    """The cut of a tile set that is nearest to a place of another one: in the same tile, and of the same kind."""
    x, y = place.at[0] - laid.first, place.at[1] - laid.first
    corners, n = laid.corners, laid.plan.side
    kind = place.cluster.startswith("t")
    near = corners[(corners[:, 0] // n == x // n) & (corners[:, 1] // n == y // n) & (corners[:, 2] == kind)]
    if not len(near):
        return None
    best = near[((near[:, :2] - [x, y]) ** 2).sum(1).argmin()]
    return Place((int(best[0]) + laid.first, int(best[1]) + laid.first), place.cluster)


def _shuffled(found: list[Place], rng: np.random.Generator) -> list[Place]:
    return [found[k] for k in rng.permutation(len(found))]
