"""The information gain that a policy reads beside the scores."""

from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.field import read_field
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction import ground
from dav_gswt.views import pose_maps
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.coverage import ERROR_WIDTH, DirectionalCoverage, GroundCells, measure_cell_errors
from dav_gswt.views.policies import NEEDS_FIELD, NEEDS_PHOTOS, PRIOR_POLICIES
from dav_gswt.views.scores import Scores
from dav_gswt.views.scoring import scoring_camera

Files = dict  # of the rule's inputs: a path, or for `captures` a list of paths


def build_information_gain(
    policy: str, scores: Scores, candidates: Candidates, taken: list[Camera], split: ViewSplit, files: Files
) -> DirectionalCoverage | None:
    """Build the information gain for policies that need the field; None for others.

    taken: cameras of the photos so far. files: `field`, `ground`, `maps` and `frame`; `images`, `model` and
    `captures` for policies that need photos. Candidates are in the order of the scores.
    """
    if policy not in NEEDS_FIELD:
        return None
    cells = GroundCells(read_field(files["field"]), ground.read_ground(files["ground"]))
    importance = _measure_importance(policy, cells, split, files)
    seen, at = pose_maps.read_pose_maps(files["maps"])[0], {pose.name: camera for pose, camera in candidates}
    pixels = dict(zip(seen.names, seen.cells, strict=True))
    offered = cells.gather_views([at[name] for name in scores.names], [pixels[name] for name in scores.names])
    return DirectionalCoverage(cells, cells.view([scoring_camera(c) for c in taken]), offered, importance)


def _measure_importance(
    policy: str, cells: GroundCells, split: ViewSplit, files: Files
) -> Float64[Array, "cells"] | None:
    """How much each cell of the ground matters to a policy; None: all alike."""
    if policy in NEEDS_PHOTOS:
        views = read_training_views(files["images"], files["model"], split.start, list(files["captures"]), ERROR_WIDTH)
        corrected = read_scene_frame(files["frame"]).kind == "photos"  # photos differ in exposure
        return measure_cell_errors(cells, views, corrected)
    if policy in PRIOR_POLICIES:
        gaussians = pose_maps.read_pose_maps(files["maps"])[1]
        return cells.average(pose_maps.apply_uncertainty(cells.field, gaussians).uncertainty)
    return None
