"""A finished field instead of photos: the surface under it is found, so that levels and tiles can be made of it."""

import logging
from dataclasses import replace

import numpy as np

from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.build import BLOCK, FitSettings, most_discs
from dav_gswt.reconstruction.discs import WIDTH
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.top_view import from_above

_log = logging.getLogger(__name__)

OPAQUE = 0.5  # alpha from which a cell's height is taken from the field


def enter(field: GaussianField, frame: SceneFrame, quality: FitSettings) -> tuple[GaussianField, Ground]:
    """The field as it is, cut to its exemplar, and the grid of the surface that it shows from above.

    The spacing follows from the field's own Gaussians: a disc of the grid is as wide as their median.
    """
    across = np.sort(np.exp(field.log_scales), 1)[:, 1]
    spacing = float(np.median(across)) / WIDTH
    none = np.zeros((0, 3))
    grid = ground.lay(frame, none, spacing, most_discs(quality), BLOCK, margin=0.0)
    inside = field[grid.contains(field.means)]
    inside = replace(inside, ground=np.zeros(len(inside), bool))  # a field of ours has discs, but of another grid
    maps = from_above(inside, grid)
    solid = maps.alpha > OPAQUE
    rows, columns = np.nonzero(solid)
    points = grid.centres.reshape(*grid.shape, 3)[rows, columns]
    points[:, 2] = maps.height[rows, columns]
    grid = replace(grid, seen=solid)
    heights = ground.surface(grid, points[:: max(1, len(points) // 50_000)])
    _log.info("finished field: %d Gaussians over %d x %d cells", len(inside), *grid.shape)
    # if its discs once lay on a grid, it was another one
    return replace(inside, ground=np.zeros(len(inside), bool)), replace(grid, heights=heights)
