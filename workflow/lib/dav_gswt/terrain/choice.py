"""Tile choice: the Wang tile of every cell, by an integer hash of its edges.

The viewer's `terrain/choice.js` computes the same integers; tests/golden/tile_choice.json holds both to it.
"""

import numpy as np
from jaxtyping import Float, Int64
from numpy import ndarray as Array

Ints = Int64[Array, "n"]
Floats = Float[Array, "n"]
Vector = Float[Array, "3"]

WEST, SOUTH, CENTRE = 0, 1, 2  # axis of a hash: colour of the west edge, of the south edge, centre variant


def hash_cell(
    i: int | Int64[Array, "*#cells"], j: int | Int64[Array, "*#cells"], axis: int | Int64[Array, "*#cells"], salt: int
) -> int | Int64[Array, "..."]:
    """32 well mixed bits for cell (i, j): one round of the finaliser of MurmurHash3 for each coordinate.

    All is modulo 2^32: negative coordinates count in two's complement, and cells 2^32 apart are the same cell. A single
    round over a combination that is linear in i and j would mirror the world.
    """
    h = _mix(_low_word(i * 0x8DA6B343 ^ axis * 0xCB1AB31F ^ salt))
    return _mix(_low_word(h + j * 0xD8163841))


def _mix(h):
    """The finaliser of MurmurHash3: every bit of a 32-bit word acts on all of its bits."""
    h = _low_word((h ^ h >> 16) * 0x85EBCA6B)
    h = _low_word((h ^ h >> 13) * 0xC2B2AE35)
    return h ^ h >> 16


def _low_word(h):
    """Products and sums of arrays wrap at 2^64, which keeps their low 32 bits."""
    return h & 0xFFFFFFFF


def tiles_at(
    i: Int64[Array, "*cells"], j: Int64[Array, "*cells"], salt: int, variants: int, period: int = 0
) -> Int64[Array, "*cells"]:
    """Numbers of the tiles in cells: T = 16 c + 8 W + 4 N + 2 E + S.

    With two centres or more, a cell with odd i + j takes the next centre that differs from its four neighbours, if
    there is one. They are even and take the centre of the hash, so no choice depends on another.

    Args:   variants: C >= 1, the number of centres. period: (i + period, j + period) is the same cell as (i, j), unless
            it is 0.
    """
    edges, centre = _hash_edges(i, j, salt, period), _hash_centre(i, j, salt, variants, period)
    taken = 0  # a bit for each centre that a neighbour with the same edges has
    for east, north in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        same = _hash_edges(i + east, j + north, salt, period) == edges
        taken = taken | np.where(same, 1, 0) << _hash_centre(i + east, j + north, salt, variants, period)
    free = centre
    for step in reversed(range(variants)):
        other = (centre + step) % variants
        free = np.where(taken >> other & 1, free, other)
    return 16 * np.where((i + j) % 2 == 1, free, centre) + edges


def _hash_edges(i, j, salt: int, period: int):
    west, east = (hash_cell(*_first_lap(i + step, j, period), WEST, salt) & 1 for step in (0, 1))
    south, north = (hash_cell(*_first_lap(i, j + step, period), SOUTH, salt) & 1 for step in (0, 1))
    return 8 * west + 4 * north + 2 * east + south


def _hash_centre(i, j, salt: int, variants: int, period: int):
    return (hash_cell(*_first_lap(i, j, period), CENTRE, salt) >> 1) % variants


def _first_lap(i, j, period: int):
    """The cell with 0 <= j < period that is the same as (i, j)."""
    back = j // period * period if period else 0
    return i - back, j - back
