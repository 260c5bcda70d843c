"""From where a prior is asked what no photo saw: over every block of such ground, as it was trained to be asked."""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.synthetic import camera_layouts
from dav_gswt.photos.synthetic.camera_layouts import Place
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views import collision
from dav_gswt.views.candidates import Candidates

BLOCK = 0.4  # flying heights: side of the ground that one camera is put over; its picture shows 0.7
RADIUS = 0.7  # flying heights from a camera to the ground it looks at
ABOVE: list[Place] = [(80.0, 0.0, RADIUS)]  # degrees: as good as from above, and the picture's top is still defined
ASIDE: list[Place] = [(55.0, turn, RADIUS) for turn in (0.0, 90.0, 180.0, 270.0)]
FIELD_OF_VIEW = 55.0  # degrees, as in the prior's examples


def blocks(grid: Ground, there: Bool[Array, "rows columns"], flying_height: float) -> list[Float[Array, "3"]]:
    """The middle of the marked cells in each block of a lattice over the grid that has any; those with fewest first:
    they have most known ground around them."""
    found = grid.centres[there.ravel()]
    if not len(found):
        return []
    at = np.floor((found[:, :2] - [grid.west, grid.south]) / (BLOCK * flying_height)).astype(int)
    _, block, count = np.unique(at, axis=0, return_inverse=True, return_counts=True)
    return [found[block.ravel() == i].mean(0) for i in np.argsort(count, kind="stable")]


def cameras(
    places: list[Place], target: Float[Array, "3"], field: GaussianField, grid: Ground, frame: SceneFrame, size: int
) -> Candidates:
    """The cameras at places (radius in flying heights) about a target; those that would stand inside of something, or
    under the ground, are left out."""
    found = []
    for elevation, azimuth, radius in places:
        camera = camera_layouts.orbit(
            elevation, azimuth, radius * frame.flying_height, target, size, size, FIELD_OF_VIEW
        )
        centre = camera.centre[None]
        if not (collision.find_below_ground(centre, grid) | collision.find_inside_objects(centre, field)).any():
            found.append((pose_of_camera(f"virtual_{elevation:g}_{azimuth:g}", camera, frame), camera))
    return found
