"""What is no ground and no object: what stands or is sunk, and things that are cut off or were seen from above only.

What stands is told by the heights alone, as buildings are in laser scans: it is what openings of rising widths cut off
(Zhang et al. 2003), if it is taller than a share of its width. A heap of loose ground has no steep sides, and is
ground; so is what rises all over the ground, as patches of flowers do.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import (
    binary_dilation,
    binary_erosion,
    distance_transform_edt,
    grey_opening,
    label,
    median_filter,
    uniform_filter,
)

from dav_gswt.materials.maps import HALF, GroundMaps, find_wide_parts, unite
from dav_gswt.materials.objects import BORDER, LARGEST, RING, SMALLEST_STANDING, Footprint

ROUNDED = 0.35  # cells: such a deviation has every straight row of cells
TALL = 0.2  # height over width, from which something stands or is sunk; of what is wider than LARGEST: over that
STEEP, WALL = 1.0, 0.5  # a slope that loose ground does not keep, and share of a thing's rim that rises by more
LEAST_RISE = 4.0  # cells: lower things are too near to the errors of a draft
COMMON, RARE = 0.55, 3.5  # quantile of the heights of all ground, which cover has; and height over it of what stands
SPECK = 1 / 44  # of the side: width of the median of the heights, which a draft has with specks
HIDDEN = 0.1  # of the ground around a cell, from which something stands there, not only in a noisy height
WIDEST, WIDER = 0.7, 1.5  # of the side: width of the widest thing; ratio of the widths that are tried
TOUCHED = 0.2  # of a thing, and of what is around it, that may be on other things that stand or was never seen
LONG, STRAIGHT = 0.5, 0.055  # of a thing's size: length of a straight cut; and of that: its deviation from a line
UNSEEN = 45.0  # degrees from the vertical that photos are taken to have looked from, where that is not known
STANDS, SUNK, CUT, ABOVE = "stands", "sunk", "cut off", "from above"
WORDS = {
    STANDS: ("roof, hedge or canopy", "roofs, hedges or canopies"),
    SUNK: ("trench or pit", "trenches or pits"),
    CUT: ("thing cut off at a border", "things cut off at a border"),
    ABOVE: ("thing seen from above only", "things seen from above only"),
}


@dataclass(frozen=True)
class LeftOut:
    """A thing that is shown nowhere. reason: a key of WORDS; share: of the exemplar."""

    reason: str
    share: float


def describe_left_out(things: Sequence[Mapping[str, Any]]) -> list[str]:
    """A phrase for each reason: how many things, and what share of the ground. things: as in materials.json."""
    phrases = []
    for reason, words in WORDS.items():
        shares = [each["share"] for each in things if each["reason"] == reason]
        if shares:
            share = f" ({sum(shares):.0%})" if sum(shares) >= 0.01 else ""
            phrases.append(f"{len(shares)} {words[len(shares) > 1]}{share}")
    return phrases


def find_relief(maps: GroundMaps) -> list[tuple[str, Bool[Array, "m m"]]]:
    """Cells of each wide thing that stands on the ground or is sunk into it with steep sides, and which of both."""
    size = 2 * round(SPECK * maps.cells / 2) + 1
    surface, height = (median_filter(each, size) / maps.exemplar.spacing for each in (maps.surface, maps.height))
    hidden = uniform_filter(maps.cover, size) > HIDDEN
    up = find_steep_things(surface, np.where(hidden, np.minimum(surface, height), surface))
    standing = unite(up, height.shape)
    open_ground = height[tuple(distance_transform_edt(standing, return_distances=False, return_indices=True))]
    return [(STANDS, each) for each in up] + [(SUNK, each) for each in find_steep_things(-open_ground, -open_ground)]


def find_steep_things(top: Float[Array, "m m"], low: Float[Array, "m m"]) -> list[Bool[Array, "m m"]]:
    """Cells of each thing longer than an object may be that rises from its surroundings with steep sides.

    Things of rising widths are cut off by an opening. What much of the ground rises by is the height of its cover.
    top, low: heights of what is seen from above and of the ground below it, as far as that is known; in cells.
    """
    m, found = len(top), np.zeros(top.shape, bool)
    width = SMALLEST_STANDING * m
    wall, least = top - limit_slope(low, STEEP) > TALL * width, width / 2
    while width < WIDEST * m:
        side = 2 * round(width / 2) + 1
        hat = top - grey_opening(low, (side, side))
        rise = max(LEAST_RISE, TALL * min(width, LARGEST * m), RARE * np.quantile(hat, COMMON))
        pieces, number = label(find_wide_parts(hat > rise, least))
        for k in range(1, number + 1):
            own = pieces == k
            rim = own & binary_dilation(~own, iterations=RING)
            if max(map(np.ptp, np.nonzero(own))) >= LARGEST * m and wall[rim].mean() > WALL:
                found |= own
        width *= WIDER
    things, number = label(found)
    return [things == k for k in range(1, number + 1)]


def limit_slope(height: Float[Array, "m m"], slope: float) -> Float[Array, "m m"]:
    """The highest ground below these heights that nowhere rises by more than a slope. Heights in cells.

    Distances are those of paths of eight directions, at most 8 % too long.
    """
    reach = 1
    while reach < len(height):
        around, lowest = np.pad(height, reach, constant_values=np.inf), height
        for y in (0, reach, 2 * reach):
            for x in (0, reach, 2 * reach):
                rise = slope * np.hypot(y - reach, x - reach)
                lowest = np.minimum(lowest, around[y : y + len(height), x : x + len(height)] + rise)
        height, reach = lowest, 2 * reach
    return height


def find_flaw(footprint: Footprint, maps: GroundMaps, unseen: Bool[Array, "m m"], excluded: Bool[Array, "m m"]) -> str:
    """Why a thing is not used as an object; empty if it is.

    A thing may be no taller than wide times the tangent of the angle from the vertical that photos saw it from: at
    45 degrees its side is as sharp as its top.
    unseen: ground that no photo saw, and what stands; excluded: also other things and ground that is shown nowhere.
    """
    own = footprint.cells
    ring = binary_dilation(own, iterations=RING) & ~own
    width = 2 * np.sqrt(own.sum() / np.pi)
    below = (np.quantile(maps.surface[own], 0.9) - maps.surface) / maps.exemplar.spacing
    hidden = max(unseen[ring].mean(), unseen[own].mean())
    if hidden > TOUCHED or _is_cut_straight(own, excluded, below > TALL * width):
        return CUT
    tilt = UNSEEN if maps.tilt is None else float(np.median(maps.tilt[own]))
    return ABOVE if np.median(below[ring]) > max(TALL, np.tan(np.radians(tilt))) * width else ""


def _is_cut_straight(own: Bool[Array, "m m"], excluded: Bool[Array, "m m"], low: Bool[Array, "m m"]) -> bool:
    """Whether an outline runs straight along the border of other ground for a good part of a thing's size.

    low: far below the thing: where that is beyond the border, as in its shade, the thing does end there.
    """
    touching = own & ~binary_erosion(own) & binary_dilation(excluded & ~own, iterations=BORDER)
    pieces, number = label(touching, np.ones((3, 3)))
    size = max(map(np.ptp, np.nonzero(own))) + 1
    for k in range(1, number + 1):
        cells = np.argwhere(pieces == k).astype(float)
        along, across = np.linalg.svd(cells - cells.mean(0), full_matrices=False)[1] if len(cells) > 1 else (0, 0)
        length = np.sqrt(12 / len(cells)) * along  # of a line of evenly spaced cells with this spread
        beyond = excluded & ~own & binary_dilation(pieces == k, iterations=RING)
        straight = length >= LONG * size and across / np.sqrt(len(cells)) <= max(ROUNDED, STRAIGHT * length)
        if straight and low[beyond].mean() < HALF:
            return True
    return False


def drop_flawed(
    footprints: list[Footprint], maps: GroundMaps, unseen: Bool[Array, "m m"], excluded: Bool[Array, "m m"]
) -> tuple[list[Footprint], list[tuple[str, Bool[Array, "m m"]]]]:
    """The footprints that can be used, and the cells of the others with the reason."""
    taken = excluded | unite([each.cells for each in footprints], excluded.shape)
    flaws = [(find_flaw(each, maps, unseen, taken), each) for each in footprints]
    return [each for flaw, each in flaws if not flaw], [(flaw, each.cells) for flaw, each in flaws if flaw]
