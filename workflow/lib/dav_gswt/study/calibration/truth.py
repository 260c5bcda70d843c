"""What candidates truly show, at the size at which poses are scored: known where photos can be had without asking."""

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

# A photo's pixels are noisy, clipped and encoded before they are shrunk: drawn at WIDTH at once, flowers come out 0.03
# too bright. The rays that a picture this many times as wide takes are needed anyhow, to be rid of the noise.
FINE = 4


def render_truth(scene: dict, pool: Candidates, images_folder: Path | str) -> Iterator[TrainingView]:
    """The photo of each candidate in turn, WIDTH pixels across, named by its pose; weight 0 where it is masked.

    scene: its entry in the config. Of agent `render` it is the photo that would be taken, drawn at most FINE times as
    wide; of agent `replay` the one in `images_folder`.
    Raises: InputError: another agent, or a photo that is not there.
    """
    if scene["agent"] == "render":
        world = synthetic.scene_from_config(scene)
        for pose, camera in progress(pool, "draw what candidates show"):
            yield _shrink_view(pose.name, camera, synthetic.render(world, _render_camera(camera)))
    elif scene["agent"] == "replay":
        for pose, camera in pool:
            yield _shrink_view(pose.name, camera, *image_files.read_photo_and_alpha(Path(images_folder) / pose.name))
    else:
        raise InputError(f"agent {scene['agent']}: what candidates truly show is known of `render` and `replay` alone")


def write_truth(folder: Path | str, views: Iterator[TrainingView]) -> None:
    """Keep what candidates show, as PNGs named by their poses."""
    for view in views:
        image_files.write_png(Path(folder) / f"{view.name}.png", view.image)


def read_truth(pool: Candidates, folder: Path | str) -> tuple[Candidates, list[TrainingView]]:
    """The candidates whose pictures `write_truth` kept, and these. Raises: InputError: a picture of another size."""
    some = [(pose, camera) for pose, camera in pool if (Path(folder) / f"{pose.name}.png").is_file()]
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


def spread_candidates(pool: Candidates, count: int) -> Candidates:
    """`count` candidates, or all, evenly spread: each the farthest from those before, the first one first."""
    return [pool[i] for i in select_farthest_poses([pose for pose, _ in pool], count)]


def _render_camera(camera: Camera) -> Camera:
    """The candidate's own camera, unless that is wider than is needed, or too narrow."""
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
