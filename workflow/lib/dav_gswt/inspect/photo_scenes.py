"""Scenes of photos: their cameras, the points of structure from motion, the exemplar and the visible ground."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.inspect import result_files
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import ColourKey, Layer, Scene, make_outline, make_picture, to_bytes
from dav_gswt.photos.view_split import read_view_split

DEPTH = 0.12  # flying heights from a camera to its picture
MAX_SIDE = 160  # pixels of a photo's longer side
ROLES = {"start": (34, 136, 51), "pool": (68, 119, 170), "test": (238, 102, 119), "photo": (90, 90, 90)}
CAPTURE_ROLE = {"taken for a round": (170, 51, 119)}
EXEMPLAR, EXTENT = (230, 140, 0), (120, 120, 120)


def build_photos(path: Path, options: ViewOptions) -> Scene:
    """photos/: its ground.json, model, photos, and views.json where one seed alone says what each is for."""
    splits = sorted(path.parent.glob("seed*/views.json"))
    return arrange_photos(path, splits[0] if len(splits) == 1 else None, str(path), [])


def build_split(path: Path, options: ViewOptions) -> Scene:
    """views.json: the photos by what they are for."""
    return arrange_photos(result_files.find_photos(path), path, str(path), [])


def build_capture(path: Path, options: ViewOptions) -> Scene:
    """capture.json: the photos of a round among those of the scene."""
    captured = [(camera, path.parent / name) for name, camera in result_files.read_shots(path)]
    return arrange_photos(result_files.find_photos(path), None, str(path), captured)


def arrange_photos(folder: Path, split: Path | None, title: str, captured: list[tuple[Camera, Path]]) -> Scene:
    """A photos/ folder. split: views.json. captured: further cameras, and their photos."""
    from dav_gswt.photos.colmap_model import read_colmap_model  # here, not above: it loads pycolmap

    frame = read_scene_frame(folder / "ground.json")
    model = read_colmap_model(folder / "sparse")
    roles = _read_roles(split)
    depth = DEPTH * frame.flying_height
    layers, used = outline_ground(frame), {}
    for name, camera in zip(model.names, model.cameras, strict=True):
        role = roles.get(name, "photo")
        used |= {role: ROLES[role]}
        layers += make_frustum(camera, depth, ROLES[role], folder / "images" / name)
    for camera, file in captured:
        used |= CAPTURE_ROLE
        layers += make_frustum(camera, depth, next(iter(CAPTURE_ROLE.values())), file)
    if len(model.points):
        layers.append(Layer("points", model.points.astype(np.float32), colours=to_bytes(model.colours), width=3.0))
    eyes = np.array([c.centre for c in [*model.cameras, *(camera for camera, _ in captured)]]).reshape(-1, 3)
    low, high = compute_bounds(frame, eyes)
    keys = ColourKey(used | {"exemplar": EXEMPLAR, "seen by a photo": EXTENT})
    about = f"{len(eyes)} cameras, {len(model.points)} points; unit: {frame.unit[:40]}"
    return Scene(title, layers, low, high, [about], legend=[keys])


def _read_roles(split: Path | None) -> dict[str, str]:
    if split is None:
        return {}
    return {name: role for role, names in asdict(read_view_split(split)).items() for name in names}


def outline_ground(frame: SceneFrame) -> list[Layer]:
    """The borders of the exemplar and of all visible ground, at height 0."""
    square, extent = frame.exemplar, frame.extent
    return [
        make_outline(square.west, square.south, square.east, square.north, 0.0, EXEMPLAR),
        make_outline(extent.west, extent.south, extent.east, extent.north, 0.0, EXTENT),
    ]


def compute_bounds(frame: SceneFrame, eyes: Float[Array, "n 3"]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """The box of the exemplar and of places."""
    square = frame.exemplar
    points = np.concatenate([eyes, [[square.west, square.south, 0.0], [square.east, square.north, 0.0]]])
    return points.min(0), points.max(0)


def make_frustum(camera: Camera, depth: float, colour: tuple[int, int, int], photo: Path | None) -> list[Layer]:
    """A camera as the pyramid of its view, `depth` deep, with its photo as the base, where there is one."""
    w, h = camera.width, camera.height
    pixels = np.array([[0, 0], [w, 0], [w, h], [0, h]])
    rays = np.c_[(pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy], np.ones(4)] @ camera.rotation
    corners = camera.centre + depth * rays
    points = np.concatenate([camera.centre[None], corners]).astype(np.float32)
    edges = np.array([[0, 1], [0, 2], [0, 3], [0, 4], [1, 2], [2, 3], [3, 4], [4, 1]])
    layers = [Layer("lines", points, edges, colour)]
    if photo is not None and photo.is_file():
        small = image_files.shrink_to(image_files.read_photo(photo), MAX_SIDE)
        layers.append(make_picture(to_bytes(small), corners[0], corners[1] - corners[0], corners[3] - corners[0]))
    return layers
