"""Selection of poses by a policy, what the policy reads beside the scores, and poses.json, the record."""

import logging
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.field import read_field
from dav_gswt.files import read_record, write_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction import ground
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.coverage import ERROR_WIDTH, DirectionalCoverage, GroundCells, measure_cell_errors
from dav_gswt.views.policies import NEEDS_FIELD, NEEDS_PHOTOS, POLICIES, PRIOR_POLICIES, SelectionInput
from dav_gswt.views.scores import Scores, apply_uncertainty, read_pose_maps
from dav_gswt.views.scoring import scoring_camera

_log = logging.getLogger(__name__)

Files = dict  # of the rule's inputs: a path, or for `captures` a list of paths


@dataclass(frozen=True)
class PoseSelection:
    """The poses that a round requests, in the order of choice.

    k: poses of a full round. chosen_with: the preset whose round it was, where this is a copy.
    """

    policy: str
    k: int
    poses: list[Pose]
    chosen_with: str | None = None


def select_poses(policy: str, scores: Scores, inputs: SelectionInput) -> list[Pose]:
    """Return the poses that a policy chooses: k, or for `all` all. Of fewer than k all are taken, with a warning."""
    if not len(scores):
        _log.warning("no candidate pose is left: no photo is taken, the field stays as it is")
        return []
    if inputs.k > len(scores):
        _log.warning("%d poses were asked for; all candidates that are left are taken: %d", inputs.k, len(scores))
        inputs = replace(inputs, k=len(scores))
    if policy == "all":
        inputs = replace(inputs, k=len(scores))
    return [scores.poses[i] for i in POLICIES[policy].choose(scores, inputs)[: inputs.k]]


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
    seen, at = read_pose_maps(files["maps"])[0], {pose.name: camera for pose, camera in candidates}
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
        gaussians = read_pose_maps(files["maps"])[1]
        return cells.average(apply_uncertainty(cells.field, gaussians).uncertainty)
    return None


def write_pose_selection(path: Path | str, selection: PoseSelection) -> None:
    """Write poses.json."""
    values = asdict(selection)
    write_json(path, {key: value for key, value in values.items() if key != "chosen_with" or value})


def read_pose_selection(path: Path | str) -> PoseSelection:
    """Read poses.json. Raises: InputError: not such a file."""
    return read_record(path, PoseSelection, "make it again")
