"""True pictures of candidate poses, for oracle policies and for calibration.

They exist for synthetic scenes and for photo sets, where pictures of candidates are available without a capture.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import select_farthest_poses
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.training_views import WHOLE, TrainingView
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.scoring import WIDTH, scoring_camera

FINE = 4  # supersampling: photos are clipped and encoded before they are shrunk, so rendering at WIDTH is too bright


def render_truth(scene: dict, candidates: Candidates, images_folder: Path | str) -> Iterator[TrainingView]:
    """Yield the photo of each candidate at the scoring size, named by its pose; weight 0 where it is masked.

    scene: its entry in the config. Agent `render`: the photo is rendered, at most FINE times as wide, then shrunk.
    Agent `replay`: the photo is read from `images_folder`.
    Raises: InputError: another agent, or a missing photo.
    """
    if scene["agent"] == "render":
        world = synthetic.scene_from_config(scene)
        for pose, camera in progress(candidates, "render candidates"):
            yield _shrink_view(pose.name, camera, synthetic.render(world, _render_camera(camera)))
    elif scene["agent"] == "replay":
        for pose, camera in candidates:
            yield _shrink_view(pose.name, camera, *image_files.read_photo_and_alpha(Path(images_folder) / pose.name))
    else:
        agent = scene["agent"]
        raise InputError(f"agent {agent}: true pictures of candidates exist for the agents render and replay only")


def write_truth(folder: Path | str, views: Iterator[TrainingView]) -> None:
    """Write pictures of candidates as PNGs named by their poses."""
    for view in views:
        image_files.write_png(Path(folder) / f"{view.name}.png", view.image)


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


def spread_candidates(candidates: Candidates, count: int) -> Candidates:
    """Choose `count` candidates, or all, by farthest point sampling from the first one."""
    return [candidates[i] for i in select_farthest_poses([pose for pose, _ in candidates], count)]


def _render_camera(camera: Camera) -> Camera:
    """The candidate's camera, with its width clipped to [WIDTH, FINE WIDTH]."""
    across = min(max(camera.width, WIDTH), FINE * WIDTH)
    return camera.resized(across, max(1, round(across * camera.height / camera.width)))


def _shrink_view(
    name: str, camera: Camera, image: Float32[Array, "h w 3"], cover: Float32[Array, "h w"] | None = None
) -> TrainingView:
    camera = scoring_camera(camera)
    size = camera.width, camera.height
    weight = (
        np.ones(size[::-1], bool)
        if cover is None
        else image_files.shrink_image(cover[..., None], *size)[..., 0] > WHOLE
    )
    return TrainingView(name, camera, image_files.shrink_image(image, *size), weight.astype(np.float32))
