"""Sizes and positions of the exemplar, a tile, its strips and corners, in cells of the finest ground grid.

A tile of n x n cells shows nine pieces of the exemplar, its labels: the centre, half a strip along each side, and a
quarter of the corner patch in each corner. A strip is centred on an edge: its right (upper) half lies in the tile to
the right (above), its left (lower) half in the tile to the left (below), and the common corner patch is centred on
the corners, so the exemplar goes on across every border. All places and half-widths are multiples of a block, the
coarsest cell that patches are placed by, so the same patches are whole cells in every level up to it. Coarser levels
are merged from the cells of each tile (`coarse_levels`), so a tile is a whole number of the coarsest level's cells
wide.

Arrays over cells are indexed [y, x], and **row 0 is the southern one**, as cell numbers grow to the north; pictures
of maps have it at the bottom.
"""

import logging
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Int, Integer, UInt8
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.lod.store import AUTO, MAX_LEVELS
from dav_gswt.reconstruction.ground import Ground

_log = logging.getLogger(__name__)

LABELS = ("centre", "W", "E", "S", "N", "SW", "SE", "NW", "NE")  # a label's number is its index
CENTRE, W, E, S, N, SW, SE, NW, NE = range(9)
MIN_BLOCKS = 10  # blocks that a tile is wide at least: two corners, and something between them
MAX_BLOCK, MIN_PLACES = 4, 32  # a block is at most so many cells, or a tile's side over so many: patches need places
SMALLEST_DRAWN = 4  # cells of the coarsest level that a tile is wide at least then: a coarser one is never drawn
SMALLEST_LEVEL = 2  # and in any case: the least that has a slope
EDGES = 16  # tiles of one centre variant: two colours on each of four sides
TORUS = (0, 0, 1, 1)  # edge colours along a torus of sixteen tiles: every pair of neighbours occurs once


@dataclass(frozen=True)
class Exemplar:
    """A square of `cells` x `cells` ground cells of side `spacing`, from the corner (west, south), in world units."""

    west: float
    south: float
    spacing: float
    cells: int

    @classmethod
    def from_grid(cls, grid: Ground) -> "Exemplar":
        """The exemplar of a ground grid."""
        west, south, _ = grid.exemplar
        return cls(west, south, grid.spacing, grid.cells)


@dataclass(frozen=True)
class Layout:
    """Sizes in finest cells; all but `levels` and `exemplar` are multiples of `block`.

    side: of a tile, a multiple of the coarsest level's cell. strip, corner: half-widths, strip < corner. block: the
    coarsest cell that patches are placed by; the outermost `block` cells of a tile always belong to its frame of strips
    and corners.
    """

    exemplar: int
    levels: int
    side: int
    strip: int
    corner: int
    block: int = 1

    @classmethod
    def from_dict(cls, value: dict[str, int]) -> "Layout":
        """The layout of its JSON object in seams.json."""
        return cls(**{own.name: value[own.name] for own in fields(cls)})

    def to_dict(self) -> dict[str, int]:
        """The JSON object; its key `laid` holds `composed_levels`."""
        keys = ("exemplar", "levels", "laid", "side", "strip", "corner", "block")
        return {key: int(getattr(self, "composed_levels" if key == "laid" else key)) for key in keys}

    @property
    def composed_levels(self) -> int:
        """How many levels are composed of patches; the others are merged from the tile's own cells."""
        return self.block.bit_length()


@dataclass(frozen=True)
class PatchPlaces:
    """South-western cells (x, y) of the patches in the exemplar: a corner, two strips a direction, a centre a tile."""

    corner: Int[Array, "2"]
    vertical: Int[Array, "2 2"]
    horizontal: Int[Array, "2 2"]
    centres: Int[Array, "tiles 2"]


def plan_layout(exemplar: int, levels: int | str, share: float, strip: float, fitted: int = MAX_LEVELS) -> Layout:
    """Sizes for an exemplar of `exemplar` cells: tiles about `share` of it wide, strips `strip` of a tile either side.

    Args:   levels: of the tiles, or AUTO: as many as are ever drawn (see SMALLEST_DRAWN), at most MAX_LEVELS. share:
    tile side as a share of the exemplar's side, in (0, 1]. strip: half-width as a share of the tile's side. fitted:
    levels that the exemplar has. Where the exemplar holds no tile with so many levels there are fewer, and a warning
    says so.
    Raises: InputError: the exemplar cannot hold any tile.
    """
    most = _count_drawn_levels(exemplar * share) if isinstance(levels, str) else levels
    sizes = ((number, _choose_side(exemplar, number, share)) for number in range(most, 0, -1))
    number, side = next(((n, s) for n, s in sizes if s <= exemplar), (0, 0))
    if not number:
        raise InputError(
            f"tiles: a tile needs {MIN_BLOCKS} ground cells a side and the exemplar has {exemplar}: use a finer "
            "preset or photos of a larger ground"
        )
    if levels not in (AUTO, number):
        _log.warning("the exemplar's %d cells a side hold tiles with %d levels, not %d", exemplar, number, levels)
    block = 2 ** (min(number, fitted) - 1)
    while block > 1 and (block > max(MAX_BLOCK, side // MIN_PLACES) or side < MIN_BLOCKS * block):
        block //= 2
    widest = side // 2 // block - 1  # of a corner, in blocks: a strip shows something between its two
    half = min(max(2, round(side * strip / block)), widest - 1)
    corner = min(half + max(1, half // 2), widest)
    return Layout(exemplar, number, side, half * block, corner * block, block)


def _count_drawn_levels(side: float) -> int:
    """How many levels of tiles about so many cells wide are ever drawn, at most MAX_LEVELS."""
    return max([1, *(n for n in range(1, MAX_LEVELS + 1) if side / 2 ** (n - 1) >= SMALLEST_DRAWN - 0.5)])


def _choose_side(exemplar: int, levels: int, share: float) -> int:
    """The tile's side nearest to `share` of the exemplar's that is a whole number of the coarsest level's cells."""
    cell = 2 ** (levels - 1)
    least = max(
        min(cell, SMALLEST_LEVEL), -(-MIN_BLOCKS * min(cell, 2) // cell)
    )  # a level beside the finest needs blocks of two
    most = max(least, exemplar // cell)
    return min(max(int(exemplar * share / cell + 0.5), least), most) * cell


def edge_colours(tile: int) -> tuple[int, int, int, int]:
    """Edge colours (W, N, E, S) of a tile number 16 c + 8 W + 4 N + 2 E + S."""
    return tile >> 3 & 1, tile >> 2 & 1, tile >> 1 & 1, tile & 1


def arrange_torus(variant: int) -> Int[Array, "6 6"]:
    """Tile numbers of a variant's sixteen tiles, four by four so that neighbours' edges match, with a ring of the same
    around them. Row 0 is in the south.
    """
    lines = np.array(TORUS)[np.arange(-1, 6) % len(TORUS)]
    west, south = np.meshgrid(lines[:-1], lines[:-1])
    east, north = np.meshgrid(lines[1:], lines[1:])
    return EDGES * variant + 8 * west + 4 * north + 2 * east + south


def label_shifts(layout: Layout, places: PatchPlaces, tile: int) -> Int[Array, "9 2"]:
    """What to add to a cell (x, y) of a tile to get the exemplar's cell that each label shows there."""
    n, b, a = layout.side, layout.strip, layout.corner
    west, north, east, south = edge_colours(tile)
    return np.array(
        [
            places.centres[tile],
            places.vertical[west] + [b, 0],
            places.vertical[east] + [b - n, 0],
            places.horizontal[south] + [0, b],
            places.horizontal[north] + [0, b - n],
            places.corner + [a, a],
            places.corner + [a - n, a],
            places.corner + [a, a - n],
            places.corner + [a - n, a - n],
        ]
    )


def strip_shifts(layout: Layout, place: Int[Array, "2"], corner: Int[Array, "2"], upright: bool) -> Int[Array, "3 2"]:
    """The same in a strip's own cells, for its labels 0 (strip), 1 and 2 (corner patch at its start and its end)."""
    n, b, a = layout.side, layout.strip, layout.corner
    ends = np.array([[a - b, a], [a - b, a - n]])
    return np.concatenate([place[None], corner + (ends if upright else ends[:, ::-1])])


def strip_labels(
    layout: Layout, mask: Bool[Array, "h w"], place: Int[Array, "2"], corner: Int[Array, "2"], upright: bool
) -> tuple[UInt8[Array, "h w"], Int[Array, "3 2"]]:
    """A strip's label map and shifts, from where the corner patch lies in it."""
    far = np.arange(layout.side) >= layout.side // 2
    end = np.where(far, 2, 1)
    return np.where(mask, end[:, None] if upright else end, 0).astype(np.uint8), strip_shifts(
        layout, place, corner, upright
    )


def frame_labels(
    layout: Layout, vertical: Bool[Array, "2 side width"], horizontal: Bool[Array, "2 width side"], tile: int
) -> UInt8[Array, "side side"]:
    """Labels of a tile's frame, `strip` cells wide; the centre inside it.

    vertical, horizontal: by edge colour, where the corner patch lies in a strip that is cut against it at both ends;
    the first `strip` cells at each end are the corner's, so two strips never claim the same cell.
    """
    n, b = layout.side, layout.strip
    west, north, east, south = edge_colours(tile)
    upper = np.arange(n) >= n // 2  # the farther of a strip's two corners
    labels = np.full((n, n), CENTRE, np.uint8)
    labels[:b] = np.where(horizontal[south][b:], np.where(upper, SE, SW), S)
    labels[n - b :] = np.where(horizontal[north][:b], np.where(upper, NE, NW), N)
    ends = slice(b, n - b)  # below and above lie the corner squares
    rows = upper[ends, None]
    labels[ends, :b] = np.where(vertical[west][ends, b:], np.where(rows, NW, SW), W)
    labels[ends, n - b :] = np.where(vertical[east][ends, :b], np.where(rows, NE, SE), E)
    return labels


def source_cells(
    labels: Integer[Array, "h w"], shift: Int[Array, "k 2"], cell: int = 1
) -> tuple[Int[Array, "h w"], Int[Array, "h w"]]:
    """Rows and columns of the exemplar's cells that a label map shows, on a grid whose cells are `cell` finest ones."""
    y, x = np.mgrid[: labels.shape[0], : labels.shape[1]]
    move = (shift // cell)[labels]
    return y + move[..., 1], x + move[..., 0]
