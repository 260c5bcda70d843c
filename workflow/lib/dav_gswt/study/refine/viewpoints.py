"""Where to look from: assemblies of a tile and its neighbours, and cameras around the cut of the tile in the middle."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.study.refine.limits import seam
from dav_gswt.tiles.layout import EDGES, edge_colours

FOV = 40.0  # degrees
ELEVATION = 60.0  # degrees above the ground
SPREAD = 1.1  # of a view's width: half of the square around its middle that is drawn


@dataclass(frozen=True)
class Place:
    """A point of the cut. own: the tile's Gaussians around it; around: the neighbours' there, which stay as they are.

    middle: of the ground there, from the tile's south-western corner. cameras: that look at it from all sides.
    """

    middle: Float[Array, "3"]
    own: Int[Array, "n"]
    around: GaussianField
    cameras: list[Camera]


def points(labels: UInt8[Array, "n n"], apart: int) -> Int[Array, "p 2"]:
    """Cells (x, y) of the cut, so that none of it is `apart` cells from all of them along both axes."""
    left = seam(labels)
    found = []
    while left.any():
        y, x = np.argwhere(left)[0]
        found.append((x, y))
        left[max(0, y - apart + 1) : y + apart, max(0, x - apart + 1) : x + apart] = False
    return np.array(found, int).reshape(-1, 2)


def neighbours(tile: int) -> Int[Array, "3 3"]:
    """Tiles around a tile whose edge colours meet, [y, x] from the south-west; itself in the middle.

    Beside it lie tiles with its western and eastern colours exchanged, above and below it those with the other two.
    """
    west, north, east, south = edge_colours(tile)
    out = np.empty((3, 3), int)
    for j in range(3):
        for i in range(3):
            w, e = (west, east) if i == 1 else (east, west)
            n, s = (north, south) if j == 1 else (south, north)
            out[j, i] = tile - tile % EDGES + 8 * w + 4 * n + 2 * e + s
    return out


def assembly(tiles: list[GaussianField], tile: int, side: float) -> GaussianField:
    """The neighbours of a tile, laid around it."""
    numbers = neighbours(tile)
    return concatenate_fields([moved(tiles[numbers[j, i]], [(i - 1) * side, (j - 1) * side, 0.0]) for j, i in _AROUND])


_AROUND = [(j, i) for j in range(3) for i in range(3) if (j, i) != (1, 1)]


def moved(field: GaussianField, by) -> GaussianField:
    return replace(field, means=(field.means + np.asarray(by, float)).astype(np.float32))


def place(
    field: GaussianField, around: GaussianField, at: Float[Array, "2"], width: float, views: int, size: int
) -> Place:
    """A point of a tile's cut, and what is seen of it; width: of the ground in a picture. views: evenly around it."""
    own = np.flatnonzero(near(field, at, SPREAD * width))
    height = ground_height(field[own], at, 0.1 * width)
    middle = np.array([*at, height])
    looks = [camera(middle, width, 360.0 * k / views + 45.0, size) for k in range(views)]
    return Place(middle, own, around[near(around, at, SPREAD * width)], looks)


def near(field: GaussianField, at: Float[Array, "2"], half: float) -> Bool[Array, "n"]:
    return (np.abs(field.means[:, :2] - at) < half).all(1)


def ground_height(field: GaussianField, at: Float[Array, "2"], half: float) -> float:
    """Mean height of the ground's discs around a point; of all Gaussians where none is ground; 0 of none."""
    there = field[near(field, at, half)]
    there = there[there.ground] if there.ground.any() else there
    return float(there.means[:, 2].mean(dtype=float)) if len(there) else 0.0


def camera(middle: Float[Array, "3"], width: float, azimuth: float, size: int) -> Camera:
    """A square picture of ground `width` wide, from an azimuth in degrees."""
    a, e = np.radians([azimuth, ELEVATION])
    away = 0.5 * width / np.tan(np.radians(0.5 * FOV))
    eye = middle + away * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return cameras.pinhole(eye, middle, size, size, FOV)


def shifted(camera: Camera, by: Float[Array, "3"]) -> Camera:
    """The same camera somewhere else."""
    return replace(camera, translation=camera.translation - camera.rotation @ by)


def flying_height(width: float) -> float:
    """How high over the ground these cameras are: to a prior, crops are ground seen from its usual height."""
    return 0.5 * width / np.tan(np.radians(0.5 * FOV)) * np.sin(np.radians(ELEVATION))
