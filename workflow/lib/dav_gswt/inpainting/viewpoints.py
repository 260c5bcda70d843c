"""Virtual cameras over unseen ground, at elevations and distances that the prior was trained on."""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.camera_layouts import Place
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views import feasibility
from dav_gswt.views.candidates import Candidates

BLOCK = 0.4  # flying heights: side of the ground under one camera, whose picture shows 0.7
RADIUS = 0.7  # flying heights from a camera to its target
ABOVE: list[Place] = [(80.0, 0.0, RADIUS)]  # degrees: nearly from above, so that the top of the picture is defined
ASIDE: list[Place] = [(55.0, turn, RADIUS) for turn in (0.0, 90.0, 180.0, 270.0)]
FIELD_OF_VIEW = 55.0  # degrees, as of the prior's training examples


def find_targets(grid: Ground, cells: Bool[Array, "rows columns"], flying_height: float) -> list[Float[Array, "3"]]:
    """The centroid of the marked cells in each block of a lattice over the grid.

    Blocks with few marked cells come first: they have most known ground around them.
    """
    centres = grid.centres[cells.ravel()]
    if not len(centres):
        return []
    at = np.floor((centres[:, :2] - [grid.west, grid.south]) / (BLOCK * flying_height)).astype(int)
    _, block, count = np.unique(at, axis=0, return_inverse=True, return_counts=True)
    return [centres[block.ravel() == i].mean(0) for i in np.argsort(count, kind="stable")]


def place_cameras(
    places: list[Place], target: Float[Array, "3"], field: GaussianField, grid: Ground, frame: SceneFrame, size: int
) -> Candidates:
    """The cameras at places (radius in flying heights) about a target that are neither in an object nor underground."""
    cameras = []
    for elevation, azimuth, radius in places:
        distance = radius * frame.flying_height
        camera = camera_layouts.orbit(elevation, azimuth, distance, target, size, size, FIELD_OF_VIEW)
        centre = camera.centre[None]
        if not (feasibility.find_below_ground(centre, grid) | feasibility.find_inside_objects(centre, field)).any():
            cameras.append((pose_of_camera(f"virtual_{elevation:g}_{azimuth:g}", camera, frame), camera))
    return cameras
