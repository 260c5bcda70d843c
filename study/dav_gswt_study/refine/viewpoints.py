"""Views of the seams of a tile among its neighbours."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.tiles.layout import EDGES, edge_colours
from dav_gswt_study.refine.limits import find_seam

FOV = 40.0  # degrees
ELEVATION = 60.0  # degrees above the ground
SPREAD = 1.1  # of a view's width: half of the square around its middle that is drawn


@dataclass(frozen=True)
class SeamView:
    """A point of a seam and the cameras around it. own: the tile's Gaussians nearby. around: those of the neighbours.
    middle: on the ground, from the tile's south-western corner."""

    middle: Float[Array, "3"]
    own: Int[Array, "n"]
    around: GaussianField
    cameras: list[Camera]


def find_seam_points(labels: UInt8[Array, "n n"], apart: int) -> Int[Array, "p 2"]:
    """Cells (x, y) of the seam such that each of its cells is nearer than `apart` cells to one of them."""
    left = find_seam(labels)
    found = []
    while left.any():
        y, x = np.argwhere(left)[0]
        found.append((x, y))
        left[max(0, y - apart + 1) : y + apart, max(0, x - apart + 1) : x + apart] = False
    return np.array(found, int).reshape(-1, 2)


def neighbouring_tiles(tile: int) -> Int[Array, "3 3"]:
    """Tiles with matching edge colours around a tile, [y, x] from the south-west; the tile itself in the middle.

    To its sides are tiles with western and eastern colours exchanged, above and below those with the other two.
    """
    west, north, east, south = edge_colours(tile)
    out = np.empty((3, 3), int)
    for j in range(3):
        for i in range(3):
            w, e = (west, east) if i == 1 else (east, west)
            n, s = (north, south) if j == 1 else (south, north)
            out[j, i] = tile - tile % EDGES + 8 * w + 4 * n + 2 * e + s
    return out


def assemble_neighbours(tiles: list[GaussianField], tile: int, side: float) -> GaussianField:
    """The neighbours of a tile, placed around it."""
    numbers = neighbouring_tiles(tile)
    return concatenate_fields(
        [translate_field(tiles[numbers[j, i]], [(i - 1) * side, (j - 1) * side, 0.0]) for j, i in _AROUND]
    )


_AROUND = [(j, i) for j in range(3) for i in range(3) if (j, i) != (1, 1)]


def translate_field(field: GaussianField, by) -> GaussianField:
    return replace(field, means=(field.means + np.asarray(by, float)).astype(np.float32))


def view_seam(
    field: GaussianField, around: GaussianField, at: Float[Array, "2"], width: float, views: int, size: int
) -> SeamView:
    """A point of a seam and its cameras. width: of the ground in a picture. views: number of cameras around it."""
    own = np.flatnonzero(mask_near(field, at, SPREAD * width))
    height = ground_height(field[own], at, 0.1 * width)
    middle = np.array([*at, height])
    around_it = [make_camera(middle, width, 360.0 * k / views + 45.0, size) for k in range(views)]
    return SeamView(middle, own, around[mask_near(around, at, SPREAD * width)], around_it)


def mask_near(field: GaussianField, at: Float[Array, "2"], half: float) -> Bool[Array, "n"]:
    return np.asarray((np.abs(field.means[:, :2] - at) < half).all(1))


def ground_height(field: GaussianField, at: Float[Array, "2"], half: float) -> float:
    """Mean height of the ground's discs around a point; of all Gaussians if none is ground; 0 of none."""
    there = field[mask_near(field, at, half)]
    there = there[there.ground] if there.ground.any() else there
    return float(there.means[:, 2].mean(dtype=float)) if len(there) else 0.0


def make_camera(middle: Float[Array, "3"], width: float, azimuth: float, size: int) -> Camera:
    """A square picture of ground `width` wide, from an azimuth in degrees."""
    a, e = np.radians([azimuth, ELEVATION])
    away = 0.5 * width / np.tan(np.radians(0.5 * FOV))
    eye = middle + away * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return cameras.pinhole(eye, middle, size, size, FOV)


def shift_camera(camera: Camera, by: Float[Array, "3"]) -> Camera:
    """The camera translated."""
    return replace(camera, translation=camera.translation - camera.rotation @ by)


def flying_height(width: float) -> float:
    """Height of these cameras above the ground."""
    return 0.5 * width / np.tan(np.radians(0.5 * FOV)) * np.sin(np.radians(ELEVATION))
