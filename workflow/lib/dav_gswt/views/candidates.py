"""Candidate poses: where a camera may stand and look, or the photos of a replayed scene.

Where photos can be taken, the scene's `poses` says which: `free` (any direction, distance and aim point over the
exemplar), `orbit` (on a hemisphere, all looking at the middle), or a table that describes a route.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera, pinhole
from dav_gswt.geometry.poses import Pose, pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.lenses import find_main_camera
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.view_split import ViewSplit

Candidates = list[tuple[Pose, Camera]]

FREE_RADII = (0.4, 1.5)  # flying heights
REACHED_RADII = (0.4, 1.0)  # flying heights, for devices and people: never higher than the first photos were taken
LOWEST = 30.0  # degrees of elevation, of candidates of photographed scenes
HEADINGS = 4  # at each stop of a route
ANY_FIELD = 60.0  # degrees, of a camera that gets another lens


def list_remaining(
    scene: dict, frame: SceneFrame, model_folder: Path | str, split: ViewSplit, captures: list
) -> Candidates:
    """List the candidates of a scene that earlier captures have not used.

    split: views.json. captures: folders of earlier rounds. Where photos are yet to be taken, all candidates have the
    lens of most pictures, the one that further photos are localised with.
    """
    if scene["agent"] == "render":
        listed = list_poses(scene, frame, synthetic.lens(scene["size"]))
    else:
        known = read_colmap_model(model_folder)
        if scene["agent"] == "replay":
            shown = [(name, known.camera(name)) for name in split.pool]
            listed = [(pose_of_camera(name, camera, frame), camera) for name, camera in shown]
        else:
            listed = list_poses(scene, frame, find_main_camera(known.cameras))
    # a photo taken in place of another is used too
    taken = [photo for folder in captures for photo in read_capture_record(folder)]
    used = {name for photo in taken for name in (photo.pose.name, photo.name)}
    return [(pose, camera) for pose, camera in listed if pose.name not in used]


def list_poses(scene: dict, frame: SceneFrame, lens: Camera) -> Candidates:
    """List the poses that a scene's `poses` describes.

    scene: its keys `agent`, `candidates` (number), `poses`, and of synthetic scenes `min_elevation` (degrees) are used.
    lens: a camera whose lens and picture all have.
    Raises: InputError: a route without length.
    """
    poses = scene["poses"]
    if isinstance(poses, str):
        found = _stand_around(scene, poses == "free", frame, lens)
    else:
        found = _stand_along_route(scene["candidates"], poses, frame, lens)
    return [(pose_of_camera(f"pose_{i:04d}", camera, frame), camera) for i, camera in enumerate(found)]


def _stand_around(scene: dict, free: bool, frame: SceneFrame, lens: Camera) -> list[Camera]:
    """Cameras all around, each looking at its own aim point (free) or all at the middle (orbit)."""
    count, lowest = scene["candidates"], scene.get("min_elevation", LOWEST)
    radii, aims = (1.0, 1.0), 0.0
    if free:
        radii, aims = FREE_RADII if scene["agent"] == "render" else REACHED_RADII, 1.0
    low, high = (frame.flying_height * radius for radius in radii)
    placed = camera_layouts.spread_free(count, lowest, (low, high), aims * frame.exemplar.side)
    return [
        _with_lens(
            camera_layouts.orbit(*place, frame.exemplar.centre + [*aim, 0.0], lens.width, lens.height, ANY_FIELD), lens
        )
        for place, aim in placed
    ]


def _stand_along_route(count: int, poses: dict, frame: SceneFrame, lens: Camera) -> list[Camera]:
    """Cameras at stops along a route, at each looking down to the ground ahead, to the left, back and to the right.

    From stop to stop the headings turn by a quarter of a right angle, so that few photos see all directions.
    """
    height, down = poses["height"] * frame.flying_height, np.radians(poses["down"])
    places = frame.exemplar.side * np.asarray(poses["places"], float)
    try:
        stops, ahead = camera_layouts.spread_along(places, -(-count // HEADINGS))
    except ValueError as error:
        raise InputError(f"poses.places: {error}") from error
    found = []
    for i, (stop, azimuth) in enumerate(zip(stops, ahead, strict=True)):
        eye = frame.exemplar.centre + [*stop, height]
        for heading in range(HEADINGS):
            turn = np.radians(azimuth + 360 / HEADINGS * (heading + (i % HEADINGS) / HEADINGS))
            way = np.array([np.cos(down) * np.cos(turn), np.cos(down) * np.sin(turn), -np.sin(down)])
            found.append(_with_lens(pinhole(eye, eye + way, lens.width, lens.height, ANY_FIELD), lens))
    return found[:count]


def _with_lens(camera: Camera, lens: Camera) -> Camera:
    return replace(camera, **{name: getattr(lens, name) for name in ("fx", "fy", "cx", "cy")})


def read_captured_cameras(model_folder: Path | str, split: ViewSplit, captures: list) -> list[Camera]:
    """Read the cameras of all photos so far."""
    known = read_colmap_model(model_folder)
    start = [known.camera(name) for name in split.start]
    return start + [photo.camera for folder in captures for photo in read_capture_record(folder)]
