"""A finished field instead of photos: prepared with the surface under it, so that levels and tiles can be made."""

import logging
from dataclasses import replace

import numpy as np

from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.coarse import BLOCK
from dav_gswt.reconstruction.discs import WIDTH
from dav_gswt.reconstruction.fit_settings import limit_discs
from dav_gswt.reconstruction.fitting.plan import Count
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.top_view import render_top_view

_log = logging.getLogger(__name__)

OPAQUE = 0.5  # alpha above which a cell takes its height from the field


def prepare_external_field(
    field: GaussianField, frame: SceneFrame, max_gaussians: Count
) -> tuple[GaussianField, Ground]:
    """The field cut to its exemplar, and the grid of its surface as seen from above.

    The grid's spacing follows from the field's Gaussians: a disc is as wide as their median.
    """
    across = np.sort(np.exp(field.log_scales), 1)[:, 1]
    spacing = float(np.median(across)) / WIDTH
    none = np.zeros((0, 3))
    grid = ground.fit_ground(frame, none, spacing, limit_discs(max_gaussians), BLOCK, margin=0.0)
    inside = field[grid.contains(field.means)]
    inside = replace(inside, ground=np.zeros(len(inside), bool))  # its discs, if any, are of another grid
    maps = render_top_view(inside, grid)
    solid = maps.alpha > OPAQUE
    rows, columns = np.nonzero(solid)
    points = grid.centres.reshape(*grid.shape, 3)[rows, columns]
    points[:, 2] = maps.height[rows, columns]
    grid = replace(grid, seen=solid)
    heights = ground.fit_surface(grid, points[:: max(1, len(points) // 50_000)])
    _log.info("finished field: %d Gaussians over %d x %d cells", len(inside), *grid.shape)
    return replace(inside, ground=np.zeros(len(inside), bool)), replace(grid, heights=heights)
