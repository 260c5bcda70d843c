"""True pictures of candidate poses, where they can be rendered or are among the photos of a replayed scene."""

from collections.abc import Iterator
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import select_farthest_poses
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.policy_inputs import read_replayed, shrink_view
from dav_gswt.views.scoring import WIDTH

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
            yield shrink_view(pose.name, camera, synthetic.render(world, _render_camera(camera)))
    elif scene["agent"] == "replay":
        yield from read_replayed(candidates, images_folder)
    else:
        agent = scene["agent"]
        raise InputError(f"agent {agent}: true pictures of candidates exist for the agents render and replay only")


def write_truth(folder: Path | str, views: Iterator[TrainingView]) -> None:
    """Write pictures of candidates as PNGs named by their poses."""
    for view in views:
        image_files.write_png(Path(folder) / f"{view.name}.png", view.image)


def spread_candidates(candidates: Candidates, count: int) -> Candidates:
    """Choose `count` candidates, or all, by farthest point sampling from the first one."""
    return [candidates[i] for i in select_farthest_poses([pose for pose, _ in candidates], count)]


def _render_camera(camera: Camera) -> Camera:
    """The candidate's camera, with its width clipped to [WIDTH, FINE WIDTH]."""
    across = min(max(camera.width, WIDTH), FINE * WIDTH)
    return camera.resized(across, max(1, round(across * camera.height / camera.width)))
