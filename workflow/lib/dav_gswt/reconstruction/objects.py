"""Objects on the ground as Gaussians: the shell that the sweep saw, down to the ground at its rims."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import cKDTree

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction.discs import OBJECT_HEIGHT
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.photo_colours import median_colours
from dav_gswt.reconstruction.plane_sweep import Relief

SIZE = 0.6  # standard deviation of a shell's Gaussian, in cells of the sweep
WALL_SPACING = 1.2  # cells between the Gaussians of a wall, vertically
OPAQUE = 2.0  # opacity logit of a shell before the first step
CLEARANCE = 2.0  # cells of the sweep that an object may extend beyond what the sweep saw
MAX_ISOLATION = 4.0  # spacings to its neighbours, beyond which a point in the air is a wrong match


def make_shell(relief: Relief, views: list[TrainingView]) -> GaussianField:
    """Round Gaussians at the top of cells with an object, and below down to the lowest neighbouring cell."""
    grid, cell = relief.grid, relief.grid.spacing
    tops = np.where(relief.stands, relief.above, 0)
    lowest = minimum_filter(tops, footprint=[[0, 1, 0], [1, 1, 1], [0, 1, 0]])
    rows = np.flatnonzero(relief.stands)
    places = grid.centres[rows]
    top, drop = tops.ravel()[rows], (tops - lowest).ravel()[rows]
    layers = np.maximum(1, np.ceil(drop / (WALL_SPACING * cell)).astype(int))
    which = np.repeat(np.arange(len(rows)), layers)
    down = np.arange(len(which)) - np.repeat(np.cumsum(layers) - layers, layers)
    points = places[which]
    points[:, 2] += top[which] - down * WALL_SPACING * cell
    colours, known = median_colours(points, views)
    return make_blobs(points[known], colours[known], np.full(int(known.sum()), SIZE * cell))


def make_isolated_points(
    grid: Ground, relief: Relief, points: Float[Array, "n 3"], colours: Float[Array, "n 3"], band: float
) -> GaussianField:
    """Gaussians at groups of matched points above the surface, up to `band`, where the sweep saw nothing."""
    inside = grid.contains(points)
    points, colours = points[inside], colours[inside]
    above = points[:, 2] - grid.height_at(points)
    known = relief.grid.contains(points)
    covered = np.zeros(len(points), bool)
    covered[known] = maximum_filter(relief.stands, 3)[_cell(relief.grid, points[known])]
    raised = (above > OBJECT_HEIGHT * grid.spacing) & (above < band) & ~covered
    points, colours = points[raised], colours[raised]
    apart = np.full(len(points), np.inf)
    if len(points) > 3:
        apart = np.asarray(cKDTree(points).query(points, k=4)[0])[:, 1:].mean(1)
    together = apart < MAX_ISOLATION * grid.spacing
    size = np.clip(0.5 * apart[together], 0.5 * grid.spacing, 1.5 * grid.spacing)
    return make_blobs(points[together], colours[together], size, logit=0.0)


def compute_ceiling(grid: Ground, relief: Relief, occluders: GaussianField) -> Float[Array, "rows columns"]:
    """Largest height of objects above the surface, by cell of the ground; the photos see through all above.

    It is the largest height of the sweep and of Gaussians within CLEARANCE cells, and CLEARANCE cells more.
    """
    tops = np.where(relief.stands, relief.above, 0)
    if len(occluders):
        row, column = _cell(relief.grid, occluders.means)
        above = occluders.means[:, 2] - relief.grid.height_at(occluders.means)
        np.maximum.at(tops, (row, column), above)
    reach = 2 * int(CLEARANCE) + 1
    return relief.onto(grid, maximum_filter(tops, reach)) + CLEARANCE * relief.grid.spacing


def make_blobs(
    points: Float[Array, "n 3"], colours: Float[Array, "n 3"], sizes: Float[Array, "n"], logit: float = OPAQUE
):
    """Round Gaussians at points."""
    n = len(points)
    return GaussianField(
        points.astype(np.float32),
        np.repeat(np.log(np.maximum(sizes, 1e-12))[:, None], 3, 1).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, logit, np.float32),
        rgb_to_sh(colours),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def _cell(grid: Ground, points: Float[Array, "n 3"]) -> tuple[Array, Array]:
    rows, columns = grid.shape
    row = np.clip((points[:, 1] - grid.south) / grid.spacing, 0, rows - 1).astype(int)
    return row, np.clip((points[:, 0] - grid.west) / grid.spacing, 0, columns - 1).astype(int)
