"""Inputs of single policies beside the scores: the information gain, and true pictures of candidates for oracles.

True pictures exist for synthetic scenes and for photo sets, without a capture.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import WHOLE, TrainingView, read_training_views
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction import ground, regression_guard
from dav_gswt.views import pose_maps
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.coverage import ERROR_WIDTH, DirectionalCoverage, GroundCells, measure_cell_errors
from dav_gswt.views.policies import NEEDS_FIELD, NEEDS_PHOTOS, ORACLES, PRIOR_POLICIES, InformationGain
from dav_gswt.views.scores import Scores
from dav_gswt.views.scoring import scoring_camera

Files = dict  # of the rule's inputs: a path, or for `captures` and `fits` a list of paths


def build_information_gain(
    policy: str, scores: Scores, candidates: Candidates, taken: list[Camera], split: ViewSplit, files: Files, agent: str
) -> InformationGain | None:
    """Build the information gain for policies that need the field; None for others.

    taken: cameras of the photos so far. files: `field`, `ground`, `maps` and `frame`; `images`, `model`, `captures` and
    `fits` for policies that need photos; `truth` (folder of true pictures of candidates), for a replayed scene
    `images`, for oracles. Candidates are in the order of the scores.
    Raises: InputError: no true picture of a candidate is left.
    """
    if policy not in NEEDS_FIELD:
        return None
    cells = GroundCells(read_field(files["field"]), ground.read_ground(files["ground"]))
    importance = _measure_importance(policy, cells, candidates, split, files, agent)
    seen, at = pose_maps.read_pose_maps(files["maps"])[0], {pose.name: camera for pose, camera in candidates}
    pixels = dict(zip(seen.names, seen.cells, strict=True))
    offered = cells.gather_views([at[name] for name in scores.names], [pixels[name] for name in scores.names])
    return DirectionalCoverage(cells, cells.view([scoring_camera(c) for c in taken]), offered, importance)


def _measure_importance(
    policy: str, cells: GroundCells, candidates: Candidates, split: ViewSplit, files: Files, agent: str
) -> Float64[Array, "cells"] | None:
    """How much each cell of the ground matters to a policy; None: all alike."""
    corrected = read_scene_frame(files["frame"]).kind == "photos"  # photos differ in exposure
    if policy in NEEDS_PHOTOS:
        return measure_cell_errors(cells, _read_photos(split, files), corrected)
    if policy in PRIOR_POLICIES:
        gaussians = pose_maps.read_pose_maps(files["maps"])[1]
        return cells.average(pose_maps.apply_uncertainty(cells.field, gaussians).uncertainty)
    if policy in ORACLES:
        return measure_cell_errors(cells, _read_truth(candidates, files, agent), corrected)
    return None


def _read_photos(split: ViewSplit, files: Files) -> list[TrainingView]:
    """The photos so far, but for those that an update rejected."""
    views = read_training_views(files["images"], files["model"], split.start, list(files["captures"]), ERROR_WIDTH)
    aside = regression_guard.list_rejected_photos(map(read_json, files["fits"]))
    return [view for view in views if view.name not in aside]


def _read_truth(candidates: Candidates, files: Files, agent: str) -> list[TrainingView]:
    """The true pictures of candidates, where they are known."""
    if agent == "replay":
        return list(read_replayed(candidates, files["images"]))
    found = read_truth(candidates, files["truth"])[1]
    if not found:
        raise InputError(f"{files['truth']}: shows no candidate that is left; make it again with more of them")
    return found


def read_replayed(candidates: Candidates, folder: Path | str) -> Iterator[TrainingView]:
    """Yield the photo of each candidate of a replayed scene at the scoring size; weight 0 where it is masked."""
    for pose, camera in candidates:
        yield shrink_view(pose.name, camera, *image_files.read_photo_and_alpha(Path(folder) / pose.name))


def read_truth(candidates: Candidates, folder: Path | str) -> tuple[Candidates, list[TrainingView]]:
    """Read the candidates whose pictures exist, and the pictures. Raises: InputError: a picture of another size."""
    some = [(pose, camera) for pose, camera in candidates if (Path(folder) / f"{pose.name}.png").is_file()]
    found = []
    for pose, camera in some:
        image = image_files.read_photo(path := Path(folder) / f"{pose.name}.png")
        camera = scoring_camera(camera)
        if image.shape != (camera.height, camera.width, 3):
            raise InputError(
                f"{path}: {image.shape[1]} x {image.shape[0]} pixels, not those of its pose; make it again"
            )
        found.append(TrainingView(pose.name, camera, image, np.ones(image.shape[:2], np.float32)))
    return some, found


def shrink_view(
    name: str, camera: Camera, image: Float32[Array, "h w 3"], cover: Float32[Array, "h w"] | None = None
) -> TrainingView:
    """A true picture at the scoring size, named by its pose. cover: 0 where it is masked."""
    camera = scoring_camera(camera)
    size = camera.width, camera.height
    weight = (
        np.ones(size[::-1], bool)
        if cover is None
        else image_files.shrink_image(cover[..., None], *size)[..., 0] > WHOLE
    )
    return TrainingView(name, camera, image_files.shrink_image(image, *size), weight.astype(np.float32))
