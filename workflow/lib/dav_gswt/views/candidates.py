"""Candidate poses: on a hemisphere for scenes that can be photographed, at the photos of a replayed scene."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose, pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.view_split import ViewSplit

Candidates = list[tuple[Pose, Camera]]

ORBIT_POSES, LOWEST = 250, 30.0  # candidates for devices and people, and their least elevation in degrees


def list_remaining(
    scene: dict, frame: SceneFrame, model_folder: Path | str, split: ViewSplit, captures: list
) -> Candidates:
    """List the candidates of a scene that earlier captures have not used.

    split: views.json. captures: folders of earlier rounds.
    """
    if scene["agent"] == "render":
        listed = list_hemisphere(scene, frame)
    else:
        known = read_colmap_model(model_folder)
        at = dict(zip(known.names, known.cameras, strict=True))
        if scene["agent"] == "replay":
            listed = [(pose_of_camera(name, at[name], frame), at[name]) for name in split.pool]
        else:
            listed = list_orbit(scene, frame, at[split.start[0]])
    used = {name for folder in captures for name in _used_names(folder)}
    return [(pose, camera) for pose, camera in listed if pose.name not in used]


def list_hemisphere(scene: dict, frame: SceneFrame) -> Candidates:
    """List poses spread evenly over the hemisphere of a synthetic scene."""
    found = synthetic.candidates(scene, frame.exemplar.centre)
    return [(pose_of_camera(f"pose_{i:04d}", camera, frame), camera) for i, camera in enumerate(found)]


def list_orbit(scene: dict, frame: SceneFrame, like: Camera) -> Candidates:
    """List poses spread evenly over the hemisphere at the flying height, for devices and people.

    scene: its keys `candidates` (number) and `min_elevation` (least elevation, degrees) are used. like: a camera of
    their lens.
    """
    places = camera_layouts.hemisphere(
        scene.get("candidates", ORBIT_POSES), scene.get("min_elevation", LOWEST), frame.flying_height
    )
    found = [camera_layouts.orbit(*place, frame.exemplar.centre, like.width, like.height, 60.0) for place in places]
    lens = {name: getattr(like, name) for name in ("fx", "fy", "cx", "cy")}
    return [(pose_of_camera(f"pose_{i:04d}", camera, frame), replace(camera, **lens)) for i, camera in enumerate(found)]


def read_captured_cameras(model_folder: Path | str, split: ViewSplit, captures: list) -> list[Camera]:
    """Read the cameras of all photos so far."""
    known = read_colmap_model(model_folder)
    at = dict(zip(known.names, known.cameras, strict=True))
    start = [at[name] for name in split.start]
    return start + [photo.camera for folder in captures for photo in read_capture_record(folder)]


def camera_positions(taken: list[Camera], frame: SceneFrame) -> Float[Array, "m 3"]:
    """Positions of cameras relative to the exemplar's centre."""
    return np.array([camera.centre - frame.exemplar.centre for camera in taken]).reshape(-1, 3)


def select_by_name(candidates: Candidates, chosen: list[Pose]) -> Candidates:
    """Return the candidates of chosen poses, by their names."""
    by_name = {pose.name: (pose, camera) for pose, camera in candidates}
    return [by_name[pose.name] for pose in chosen]


def _used_names(folder: Path | str) -> list[str]:
    """Names of requested poses and of captured photos: a photo taken in place of another is used too."""
    return [name for photo in read_capture_record(folder) for name in (photo.pose.name, photo.name)]
