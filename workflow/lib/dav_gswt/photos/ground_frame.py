"""The ground frame: z up, the ground near z = 0, and the square of ground that is seen well enough."""

import logging
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.photos.colmap_model import ColmapModel, transform_model
from dav_gswt.photos.planes import fit_plane, make_upright_rotation
from dav_gswt.photos.sfm.gps import GpsPositions

_log = logging.getLogger(__name__)

REACH = 3.0  # flying heights from the camera, beyond which a photo tells nothing useful about the ground
CELLS = 256  # of the coverage grid along its longer side
COARSE_CELLS = 160  # while directions of the x axis are tried
TURN = 5  # degrees between the directions tried for the x axis
INSET = 0.02  # kept from the border of the well-seen ground, as a share of the exemplar's side
NEAR = 0.25  # flying heights: ground farther than this from every point has no texture that photos agree on (water)


@dataclass(frozen=True)
class Coverage:
    """How many photos see each cell of the plane z = 0; rows from south to north, columns from west to east."""

    west: float
    south: float
    cell: float
    counts: Int[Array, "rows columns"]


def fit_ground_frame(
    model: ColmapModel, rng: np.random.Generator, positions: GpsPositions | None = None
) -> tuple[ColmapModel, SceneFrame]:
    """The model in its ground frame, and this frame.

    z points from the robust plane through all points to the cameras' side; the unit of length is the flying height, the
    median height of the cameras, or the metre where the model is in metres about GPS `positions`. x and y run so that
    the well-seen square is as large as can be; the origin lies in the middle of the ground that is seen well. Ground
    counts as seen well where at least 3 photos see it (2 of a set below 9) and structure from motion found a point
    within NEAR.
    The frame comes from all photos of the set: it says where the scene is, as a vehicle's own positioning would.
    Raises: InputError: cameras on both sides of the plane or on it, or no square of ground seen well enough.
    """
    flat, relief, height = _level_model(model, rng)
    need = 3 if len(flat.names) >= 9 else 2
    turns = np.arange(0.0, 90.0, TURN)
    flat = _turn_model(
        flat, turns[np.argmax([_find_square(_turn_model(flat, turn), need, COARSE_CELLS)[2] for turn in turns])]
    )
    grid = count_coverage(flat.cameras, flat.points)
    well = _well_seen(flat, grid, need)
    if not well.any():
        raise InputError(f"no ground is seen by {need} photos; take more photos that overlap from closer positions")
    rows, columns = np.nonzero(well)
    middle = np.array([grid.west, grid.south]) + grid.cell * (np.array([columns.mean(), rows.mean()]) + 0.5)
    flat = transform_model(flat, 1.0, np.eye(3), np.array([-middle[0], -middle[1], 0.0]))
    west, south, side = _find_square(flat, need)
    unit = height if positions else 1.0  # of the world, in flying heights; below, lengths are brought to it
    extent = _find_extent(count_coverage(flat.cameras, flat.points), unit)
    flat = transform_model(flat, unit, np.eye(3), np.zeros(3))
    _log.info("well-seen square of ground: %.2f flying heights wide; relief %.3f", side, relief)
    return flat, SceneFrame(
        kind="photos",
        unit="metre" if positions else "flying height",
        flying_height=unit,
        exemplar=Square(unit * west, unit * south, unit * side),
        extent=extent,
        photos_per_cell=need,
        relief=relief,
        georeference=_georeference(model, flat, positions) if positions else None,
    )


def _georeference(east_north_up: ColmapModel, flat: ColmapModel, positions: GpsPositions) -> Georeference:
    """Where the world's origin lies and how its +y is turned: from the move of one model to the other."""
    old, new = east_north_up.cameras[0], flat.cameras[0]
    turn = new.rotation.T @ old.rotation  # from east, north, up to the world; both in metres
    place = positions.about.to_earth((old.centre - turn.T @ new.centre)[None])[0]
    north = turn.T @ [0.0, 1.0, 0.0]
    return Georeference(
        *map(float, place),
        north=float(np.degrees(np.arctan2(north[0], north[1])) % 360),
        slope=float(np.degrees(np.arccos(np.clip(turn[2, 2], -1, 1)))),
        metres_per_unit=1.0,
    )


def count_coverage(cameras: tuple[Camera, ...], points: Float[Array, "n 3"], cells: int = CELLS) -> Coverage:
    """Count the photos that see each cell's centre on the plane z = 0, at most REACH flying heights away.

    points: the grid spans them (their 1st to 99th percentile), since ground beyond the last point is guesswork.
    The unit of length is the flying height.
    """
    low, high = np.percentile(points[:, :2], [1, 99], axis=0)
    low, high = low - NEAR, high + NEAR
    cell = float((high - low).max() / cells)
    columns, rows = np.maximum(1, np.ceil((high - low) / cell - 1e-9).astype(int))
    x, y = np.meshgrid(low[0] + (np.arange(columns) + 0.5) * cell, low[1] + (np.arange(rows) + 0.5) * cell)
    centres = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    counts = np.zeros(x.size, int)
    for camera in cameras:
        counts += find_visible_points(camera, centres)
    return Coverage(float(low[0]), float(low[1]), cell, counts.reshape(rows, columns))


def find_visible_points(camera: Camera, points: Float[Array, "n 3"]) -> Bool[Array, "n"]:
    """Which points lie inside the picture, before the camera and within REACH."""
    at, depth = camera.project(points)
    x, y = at.T
    away = points - camera.centre
    near = np.einsum("ni,ni->n", away, away) < REACH**2
    return (depth > 0) & (x > 0) & (x < camera.width) & (y > 0) & (y < camera.height) & near


def find_largest_square(mask: Bool[Array, "rows columns"]) -> tuple[int, int, int]:
    """First row, first column and side of the largest square of true cells; (0, 0, 0) where none is true.

    Every cell knows the side of the largest square that ends in it: 1 + the least of its three neighbours before it.
    The recurrence runs along anti-diagonals, all cells of one at once. Of equal squares the one nearest to the middle
    of all true cells is taken, then the first.
    """
    rows, columns = mask.shape
    ends = np.zeros((rows + 1, columns + 1), int)
    for k in range(rows + columns - 1):
        i = np.arange(max(0, k - columns + 1), min(rows, k + 1))
        j = k - i
        least = np.minimum(np.minimum(ends[i, j], ends[i, j + 1]), ends[i + 1, j])
        ends[i + 1, j + 1] = np.where(mask[i, j], least + 1, 0)
    side = int(ends.max())
    if side == 0:
        return 0, 0, 0
    corners = np.argwhere(ends == side) - side
    middle = np.argwhere(mask).mean(0) + 0.5
    apart = np.abs(corners + side / 2 - middle).max(1)
    row, column = corners[apart.argmin()]
    return int(row), int(column), side


def _level_model(model: ColmapModel, rng: np.random.Generator) -> tuple[ColmapModel, float, float]:
    """The model with z up from its plane and the flying height as unit; the points' spread about the plane in it; and
    the flying height in units of before."""
    normal, offset, spread = fit_plane(model.points, rng)
    heights = np.array([camera.centre @ normal for camera in model.cameras]) - offset
    if np.median(heights) < 0:
        normal, offset, heights = -normal, -offset, -heights
    height = float(np.median(heights))
    if height < 3 * spread or np.mean(heights < 0) > 0.2:
        raise InputError(
            "the photos do not look down on a ground: they were not taken above the plane that fits their points best; "
            "use photos taken from above the ground, or leave out those of walls, rooms and single things"
        )
    # On a circle around the place the pictures' mean right is nothing; the first picture's serves as well then.
    first, mean = model.cameras[0].rotation, np.mean([camera.rotation[0] for camera in model.cameras], axis=0)
    east = next(v for v in (mean, first[0], first[1]) if np.linalg.norm(np.cross(v, normal)) > 0.3)
    turn = make_upright_rotation(normal, east)
    level = transform_model(model, 1 / height, turn, np.array([0.0, 0.0, -offset / height]))
    return level, spread / height, height


def _turn_model(model: ColmapModel, degrees: float) -> ColmapModel:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return transform_model(model, 1.0, np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]), np.zeros(3))


def _well_seen(model: ColmapModel, grid: Coverage, need: int) -> Bool[Array, "rows columns"]:
    """Cells that enough photos see and that have a point nearby."""
    rows, columns = grid.counts.shape
    x = grid.west + (np.arange(columns) + 0.5) * grid.cell
    y = grid.south + (np.arange(rows) + 0.5) * grid.cell
    centres = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    distance, _ = cKDTree(model.points[:, :2]).query(centres, distance_upper_bound=NEAR)
    return (grid.counts >= need) & np.isfinite(distance).reshape(rows, columns)


def _find_square(model: ColmapModel, need: int, cells: int = CELLS) -> tuple[float, float, float]:
    """West, south and side of the largest well-seen square, a little inside it."""
    grid = count_coverage(model.cameras, model.points, cells)
    row, column, side = find_largest_square(_well_seen(model, grid, need))
    inset = INSET * side * grid.cell
    west, south = grid.west + column * grid.cell + inset, grid.south + row * grid.cell + inset
    return float(west), float(south), float(side * grid.cell - 2 * inset)


def _find_extent(grid: Coverage, unit: float) -> Extent:
    """The bounding rectangle of the cells that at least one photo sees. unit: the grid's, in world units."""
    rows, columns = np.nonzero(grid.counts)
    return Extent(
        west=unit * (grid.west + float(columns.min()) * grid.cell),
        south=unit * (grid.south + float(rows.min()) * grid.cell),
        east=unit * (grid.west + float(columns.max() + 1) * grid.cell),
        north=unit * (grid.south + float(rows.max() + 1) * grid.cell),
    )
