"""The ground frame: z up, the ground near z = 0, and the square of ground that is seen well enough."""

import logging
from bisect import bisect
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.photos.colmap_model import ColmapModel, transform_model

_log = logging.getLogger(__name__)

TRIALS = 500  # planes through three random points; at half outliers one in eight has none
REACH = 3.0  # flying heights from the camera, beyond which a photo tells nothing useful about the ground
CELLS = 256  # of the coverage grid along its longer side
COARSE_CELLS = 160  # while directions of the x axis are tried
TURN = 5  # degrees between the directions tried for the x axis
INSET = 0.02  # kept from the border of the well-seen ground, as a share of the exemplar's side
NEAR = 0.25  # flying heights: ground farther than this from every point has no texture that photos agree on (water)
PHOTOGRAPH_GROUND = (
    "Photograph an open patch of ground (sand, grass, gravel) from above, looking down; leave out photos of rooms, "
    "walls and single things"
)


@dataclass(frozen=True)
class Coverage:
    """How many photos see each cell of the plane z = 0; rows from south to north, columns from west to east."""

    west: float
    south: float
    cell: float
    counts: Int[Array, "rows columns"]

    @property
    def centres(self) -> Float[Array, "n 2"]:
        rows, columns = self.counts.shape
        x = self.west + (np.arange(columns) + 0.5) * self.cell
        y = self.south + (np.arange(rows) + 0.5) * self.cell
        return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


def fit_plane(
    points: Float[Array, "n 3"], rng: np.random.Generator, up: Float[Array, "3"] | None = None
) -> tuple[Float[Array, "3"], float, float]:
    """A robust plane through points: unit normal n and offset d of n . p = d, and the points' spread about it.

    Least median of |n . p - d| over TRIALS planes through three points, then ten rounds of least
    squares under Geman-McClure weights (1 + (r / s)^2)^-2. The scale s is 1.4826 times the median
    residual of the first plane, the standard deviation of normal residuals, so hills and trees may
    be up to half of the points.
    up: a rough direction upwards, if known. Then only planes within 45 degrees of level are tried,
    and n points upwards. Sums have one order, since those of BLAS depend on the number of its
    threads.
    Raises: InputError: fewer than three points, all on one line, or none in such a plane.
    """
    if len(points) < 3:
        raise InputError("fewer than three points of the ground are known; take more photos that overlap")
    middle = np.median(points, axis=0)
    centred = points - middle
    sample = centred[rng.choice(len(points), min(len(points), 2000), replace=False)]
    a, b, c = (sample[rng.integers(len(sample), size=TRIALS)] for _ in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-9 * np.abs(sample).max() ** 2
    if up is not None:
        proper &= np.abs(normals @ up) > np.sqrt(0.5) * np.linalg.norm(up) * lengths
    if not proper.any():
        raise InputError("the points lie in no level plane, or all on one line: they do not determine the ground")
    normals = normals[proper] / lengths[proper, None]
    offsets = np.einsum("ti,ti->t", normals, a[proper])
    medians = np.median(np.abs(np.einsum("ni,ti->nt", sample, normals) - offsets), axis=0)
    normal, offset = normals[medians.argmin()], offsets[medians.argmin()]
    scale = 1.4826 * medians.min() + 1e-12 * np.abs(sample).max()
    for _ in range(10):
        weight = (1 + ((np.einsum("ni,i->n", centred, normal) - offset) / scale) ** 2) ** -2
        centre = np.einsum("n,ni->i", weight, centred) / weight.sum()
        away = centred - centre
        normal = np.linalg.eigh(np.einsum("ni,nj->ij", away * weight[:, None], away))[1][:, 0]
        offset = normal @ centre
    if up is not None and normal @ up < 0:
        normal, offset = -normal, -offset
    return normal, float(offset + normal @ middle), float(scale)


def make_upright_rotation(normal: Float[Array, "3"], east: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """The rotation into a frame with z along `normal` and x along the part of `east` that lies in the plane."""
    x = east - (east @ normal) * normal
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal])


def rotate_about_z(degrees: float) -> Float[Array, "3 3"]:
    """The rotation of the axes about z, counterclockwise from above."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])


def fit_ground_frame(
    model: ColmapModel, rng: np.random.Generator, about: Georeference | None = None
) -> tuple[ColmapModel, SceneFrame]:
    """The model in its ground frame, and this frame.

    z points from the robust plane through all points to the cameras' side. The unit of length is
    the flying height, the median height of the cameras, or the metre if the model is in metres
    east, north and up of the place `about`. x and y run so that the well-seen square is as large as
    can be; the origin lies in the middle of the ground that is seen well. Ground is seen well if at
    least 3 photos see it (2 of a set below 9) and there is a point within NEAR.
    Raises: InputError: cameras on both sides of the plane or on it, or no square of ground seen well enough.
    """
    flat, relief, height = _level_model(model, rng)
    need = 3 if len(flat.names) >= 9 else 2
    turns = np.arange(0.0, 90.0, TURN)
    sides = [_find_square(_turn_model(flat, turn), need, COARSE_CELLS)[2] for turn in turns]
    flat = _turn_model(flat, turns[np.argmax(sides)])
    grid = count_coverage(flat.cameras, flat.points)
    well = _well_seen(flat, grid, need)
    if not well.any():
        raise InputError(f"no ground is seen by {need} photos; take more photos that overlap from closer positions")
    rows, columns = np.nonzero(well)
    middle = np.array([grid.west, grid.south]) + grid.cell * (np.array([columns.mean(), rows.mean()]) + 0.5)
    flat = transform_model(flat, 1.0, np.eye(3), np.array([-middle[0], -middle[1], 0.0]))
    west, south, side = _find_square(flat, need)
    unit = height if about else 1.0  # of the world, in flying heights
    grid = count_coverage(flat.cameras, flat.points)
    extent = find_extent(grid.counts > 0, grid.west, grid.south, grid.cell, unit)
    flat = transform_model(flat, unit, np.eye(3), np.zeros(3))
    _log.info("well-seen square of ground: %.2f flying heights wide; relief %.3f", side, relief)
    return flat, SceneFrame(
        kind="photos",
        unit="metre" if about else "flying height",
        flying_height=unit,
        exemplar=Square(unit * west, unit * south, unit * side),
        extent=extent,
        relief=relief,
        georeference=_georeference(model, flat, about) if about else None,
    )


def _georeference(east_north_up: ColmapModel, flat: ColmapModel, about: Georeference) -> Georeference:
    """Where the world's origin lies and how its +y is turned: from the move of one model to the other."""
    old, new = east_north_up.cameras[0], flat.cameras[0]
    turn = new.rotation.T @ old.rotation  # from east, north, up to the world; both in metres
    place = about.to_earth((old.centre - turn.T @ new.centre)[None])[0]
    north = turn.T @ [0.0, 1.0, 0.0]
    return Georeference(
        *map(float, place),
        north=float(np.degrees(np.arctan2(north[0], north[1])) % 360),
        slope=float(np.degrees(np.arccos(np.clip(turn[2, 2], -1, 1)))),
        metres_per_unit=1.0,
    )


def count_coverage(cameras: tuple[Camera, ...], points: Float[Array, "n 3"], cells: int = CELLS) -> Coverage:
    """Count the photos that see each cell's centre on the plane z = 0, at most REACH flying heights away.

    The grid spans the points (their 1st to 99th percentile), since ground beyond the last point is
    guesswork. The unit of length is the flying height.
    """
    low, high = np.percentile(points[:, :2], [1, 99], axis=0)
    low, high = low - NEAR, high + NEAR
    cell = float((high - low).max() / cells)
    columns, rows = np.maximum(1, np.ceil((high - low) / cell - 1e-9).astype(int))
    grid = Coverage(float(low[0]), float(low[1]), cell, np.zeros((rows, columns), int))
    centres = np.c_[grid.centres, np.zeros(rows * columns)]
    counts = sum(find_visible_points(camera, centres).astype(int) for camera in cameras)
    return replace(grid, counts=np.reshape(counts, (rows, columns)))


def find_visible_points(camera: Camera, points: Float[Array, "n 3"], reach: float = REACH) -> Bool[Array, "n"]:
    """Which points lie inside the picture, before the camera and nearer than `reach`."""
    at, depth = camera.project(points)
    x, y = at.T
    away = points - camera.centre
    near = np.einsum("ni,ni->n", away, away) < reach**2
    return (depth > 0) & (x > 0) & (x < camera.width) & (y > 0) & (y < camera.height) & near


def find_largest_square(mask: Bool[Array, "rows columns"]) -> tuple[int, int, int]:
    """First row, first column and side of the largest square of true cells; (0, 0, 0) if none is true.

    Of equal squares the one nearest to the middle of all true cells is taken, then the first.
    """
    if not mask.any():
        return 0, 0, 0
    total = np.pad(mask.astype(int).cumsum(0).cumsum(1), ((1, 0), (1, 0)))

    def find_corners(side: int) -> Int[Array, "n 2"]:
        sums = total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]
        return np.argwhere(sums == side * side)

    sides = range(1, min(mask.shape) + 1)
    side = bisect(sides, False, key=lambda side: not len(find_corners(side)))
    corners, middle = find_corners(side), np.argwhere(mask).mean(0) + 0.5
    row, column = corners[np.abs(corners + side / 2 - middle).max(1).argmin()]
    return int(row), int(column), side


def place_square(
    mask: Bool[Array, "rows columns"], west: float, south: float, cell: float
) -> tuple[float, float, float]:
    """West, south and side of the largest square of true cells, a little inside it."""
    row, column, side = find_largest_square(mask)
    inset = INSET * side * cell
    return float(west + column * cell + inset), float(south + row * cell + inset), float(side * cell - 2 * inset)


def find_extent(mask: Bool[Array, "rows columns"], west: float, south: float, cell: float, unit: float = 1.0) -> Extent:
    """The bounding rectangle of the true cells, multiplied by a unit."""
    rows, columns = np.nonzero(mask)
    return Extent(
        west=unit * float(west + columns.min() * cell),
        south=unit * float(south + rows.min() * cell),
        east=unit * float(west + (columns.max() + 1) * cell),
        north=unit * float(south + (rows.max() + 1) * cell),
    )


def _level_model(model: ColmapModel, rng: np.random.Generator) -> tuple[ColmapModel, float, float]:
    """The model with z up from its plane and the flying height as unit; the points' spread in it;
    the flying height in the model's unit."""
    normal, offset, spread = fit_plane(model.points, rng)
    heights = np.array([camera.centre @ normal for camera in model.cameras]) - offset
    if np.median(heights) < 0:
        normal, offset, heights = -normal, -offset, -heights
    height = float(np.median(heights))
    if height < 3 * spread or np.mean(heights < 0) > 0.2:
        raise InputError(
            "the photos show no ground: they were not taken above the plane that fits their points best. "
            + PHOTOGRAPH_GROUND
        )
    # Around a circle the mean of the pictures' right is about zero, and the first picture's right is used.
    first, mean = model.cameras[0].rotation, np.mean([camera.rotation[0] for camera in model.cameras], axis=0)
    east = next(v for v in (mean, first[0], first[1]) if np.linalg.norm(np.cross(v, normal)) > 0.3)
    turn = make_upright_rotation(normal, east)
    level = transform_model(model, 1 / height, turn, np.array([0.0, 0.0, -offset / height]))
    return level, spread / height, height


def _turn_model(model: ColmapModel, degrees: float) -> ColmapModel:
    return transform_model(model, 1.0, rotate_about_z(degrees), np.zeros(3))


def _well_seen(model: ColmapModel, grid: Coverage, need: int) -> Bool[Array, "rows columns"]:
    """Cells that enough photos see and that have a point nearby."""
    distance, _ = cKDTree(model.points[:, :2]).query(grid.centres, distance_upper_bound=NEAR)
    return (grid.counts >= need) & np.isfinite(distance).reshape(grid.counts.shape)


def _find_square(model: ColmapModel, need: int, cells: int = CELLS) -> tuple[float, float, float]:
    """West, south and side of the largest well-seen square."""
    grid = count_coverage(model.cameras, model.points, cells)
    return place_square(_well_seen(model, grid, need), grid.west, grid.south, grid.cell)
