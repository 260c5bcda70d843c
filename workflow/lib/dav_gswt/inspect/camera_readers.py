"""Readers of cameras: photos, captures and candidate poses with their scores."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pyvista as pv
from jaxtyping import Float, UInt8
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.cameras import Camera, camera_from_json
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.inspect.plot import BLACK, Bar, Colour, Scene, to_bytes
from dav_gswt.inspect.readers import (
    add_solids,
    choose,
    compute_colours,
    find_above,
    outline,
    reader,
    thin_field,
    wrap_errors,
)
from dav_gswt.paths import decode_path, related_folder
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views.score_colours import HIGHEST, candidate_values
from dav_gswt.views.scores import Scores, read_scores
from dav_gswt.views.selection import read_pose_selection

DEPTH = 0.12  # flying heights from a camera to its picture
MAX_SIDE = 160  # pixels of a photo's longer side
BALL, CHOSEN_BALL, LETTER = 0.018, 0.03, 0.07  # radii and height, in radii of the hemisphere
ROLES = {"start": (34, 136, 51), "pool": (68, 119, 170), "test": (238, 102, 119), "photo": (90, 90, 90)}
CAPTURED = (170, 51, 119)
GROUND_NAMES = {"exemplar": (230, 140, 0), "seen by a photo": (120, 120, 120)}


@reader("ground.json")
def read_photos(path: Path, *, most: int) -> Scene:
    """photos/: its model and photos, by what each is for if one seed alone says so."""
    splits = sorted(path.parents[1].glob("seed*/views.json"))
    return _arrange_photos(path, path.parent, splits[0] if len(splits) == 1 else None, [])


@reader("capture.json")
def read_capture(path: Path, *, most: int) -> Scene:
    """The photos of a round among those of the scene."""
    return _arrange_photos(path, find_photos(path), None, read_shots(path))


@reader("views.json")
def read_split(path: Path, *, most: int) -> Scene:
    """The photos by what they are for."""
    return _arrange_photos(path, find_photos(path), path, [])


def read_shots(path: Path) -> list[tuple[Camera, Path]]:
    """The cameras and photos of a capture.json. Raises: InputError: damaged, or a name leads out of its folder."""
    content = read_json(path)
    with wrap_errors(path):
        shots = [(str(shot["name"]), camera_from_json(shot["got"])) for shot in content["shots"]]
    for name, _ in shots:
        if Path(name).name != name:
            raise InputError(f"{path}: {name!r} is no file's name; take the photos again")
    return [(camera, path.parent / name) for name, camera in shots]


def find_photos(path: Path) -> Path:
    """The folder photos/ of the scene that a file belongs to. Raises: InputError: there is none."""
    frame = find_above(path, "photos/ground.json")
    if frame is None:
        raise InputError(f"{path}: photos/ground.json is in no folder above it; leave it in its result tree")
    return frame.parent


def _arrange_photos(path: Path, folder: Path, split: Path | None, captured: list[tuple[Camera, Path]]) -> Scene:
    """A photos/ folder. split: views.json. captured: further cameras, and their photos."""
    from dav_gswt.photos.colmap_model import read_colmap_model  # here, not above: it loads pycolmap

    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    roles = {name: role for role, names in asdict(read_view_split(split)).items() for name in names} if split else {}
    scene, depth = Scene(str(path), []), DEPTH * frame.flying_height
    for name, camera in zip(model.names, model.cameras, strict=True):
        role = roles.get(name, "photo")
        scene.names[role] = ROLES[role]
        add_frustum(scene, camera, depth, ROLES[role], folder / "images" / name)
    for camera, file in captured:
        scene.names["taken for a round"] = CAPTURED
        add_frustum(scene, camera, depth, CAPTURED, file)
    if len(model.points):
        scene.add(pv.PolyData(model.points.astype(np.float32)), to_bytes(model.colours), style="points", point_size=3.0)
    eyes = np.array([camera.centre for camera in [*model.cameras, *(each for each, _ in captured)]]).reshape(-1, 3)
    _add_ground(scene, frame, eyes)
    scene.notes = [f"{len(eyes)} cameras, {len(model.points)} points; unit: {frame.unit[:40]}"]
    return scene


def _add_ground(scene: Scene, frame: SceneFrame, eyes: Float[Array, "n 3"]) -> None:
    """Add the borders of the exemplar and of all visible ground. The first view shows the exemplar and the eyes."""
    square = frame.exemplar
    for area, colour in zip((square, frame.extent), GROUND_NAMES.values(), strict=True):
        scene.add(outline(area.west, area.south, area.east, area.north), colour, line_width=3.0)
    points = np.concatenate([eyes, [[square.west, square.south, 0.0], [square.east, square.north, 0.0]]])
    scene.box = np.array([points.min(0), points.max(0)])
    scene.names |= GROUND_NAMES


def add_frustum(scene: Scene, camera: Camera, depth: float, colour: Colour, photo: Path | None = None) -> None:
    """Add a camera as the pyramid of its view, `depth` deep, with its photo as the base, if the file exists."""
    w, h = camera.width, camera.height
    pixels = np.array([[0, 0], [w, 0], [w, h], [0, h]])
    rays = np.c_[(pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy], np.ones(4)] @ camera.rotation
    corners = camera.centre + depth * rays
    points = np.concatenate([corners, camera.centre[None]])
    scene.add(pv.Pyramid(points).extract_all_edges(), colour, line_width=2.0)
    if photo is not None and photo.is_file():
        small = image_files.shrink_to(image_files.read_photo(photo), MAX_SIDE)
        scene.add_picture(to_bytes(small), corners[0], corners[1] - corners[0], corners[3] - corners[0])


@reader("scores.csv")
def read_candidates(path: Path, *, most: int, colour: str | None = None) -> Scene:
    """The candidates by their scores."""
    return _arrange_poses(path, None, colour, most)


@reader("poses.json")
def read_chosen(path: Path, *, most: int, colour: str | None = None) -> Scene:
    """A round's poses among the candidates, by the scores by which they were chosen."""
    return _arrange_poses(find_scores(path), path, colour, most)


def _arrange_poses(path: Path, poses: Path | None, colour: str | None, most: int) -> Scene:
    """path: scores.csv. poses: the poses.json whose poses are marked."""
    photos, table = find_photos(path), read_scores(path)
    frame = read_scene_frame(photos / "ground.json")
    if not len(table):
        raise InputError(f"{path}: no candidate is in it: none was left to choose from")
    label, values = candidate_values(table, float(decode_path((poses or path).resolve()).get("lam", 0.0)))
    if colour is not None:
        label = choose("colour", colour, tuple(table.terms), path)
        values = table.terms[label]
    title, _, unit = label.partition(", ")
    bar = Bar.of_values(title, values, most=HIGHEST)
    tint, middle = bar.map(values), frame.exemplar.centre
    at = middle + np.array([pose_offset(pose) for pose in table.poses])
    radius = float(np.median(np.linalg.norm(at - middle, axis=1)))
    chosen = _read_marked(table, poses)
    scene = Scene(str(poses or path), [f"{len(table)} candidates; {len(chosen)} chosen, numbered in order"], bars=[bar])
    scene.notes += [f"{title}: {unit}"] if unit else []
    rest = np.setdiff1d(np.arange(len(table)), chosen)
    for rows, size in ((rest, BALL), (np.array(chosen, int), CHOSEN_BALL)):
        if len(rows):
            scene.add(*make_balls(at[rows], size * radius, tint[rows]))
    for number, k in enumerate(chosen, 1):
        scene.add(pv.Line(middle, at[k]), BLACK, line_width=2.0)
        scene.add_label(f"{number}", at[k] + [0, 0, (CHOSEN_BALL + LETTER) * radius], LETTER * radius, upright=True)
    field = find_above(path, "field.ply", folders=2)
    if field and len(kept := thin_field(read_field(field), most)):
        add_solids(scene, kept, compute_colours(kept, "colour"))
    _add_ground(scene, frame, at)
    return scene


def make_balls(
    centres: Float[Array, "n 3"], radius: float, colours: UInt8[Array, "n 3"]
) -> tuple[pv.DataSet, UInt8[Array, "m 3"]]:
    """A ball at each place, and the colours of its points."""
    ball = pv.Icosphere(radius=radius, nsub=2)
    balls = pv.PolyData(centres.astype(np.float32)).glyph(geom=ball, scale=False, orient=False)
    return balls, np.repeat(colours, ball.n_points, 0)


def _read_marked(table: Scores, poses: Path | None) -> list[int]:
    """The rows of a poses.json among the candidates, in order."""
    if poses is None:
        return []
    content = read_json(poses)
    with wrap_errors(poses):
        names = [str(pose["name"]) for pose in content["poses"]]
    index = {name: i for i, name in enumerate(table.names)}
    if unknown := [name for name in names if name not in index]:
        raise InputError(f"{poses}: {unknown[0]} is not among the scored poses; give the poses of the round after")
    return [index[name] for name in names]


def find_scores(poses: Path) -> Path:
    """The scores that a round's poses were chosen by, of another preset if that chose them.

    Raises: InputError: they are not where the workflow puts them.
    """
    poses = poses.resolve()
    number = int(decode_path(poses).get("t", 0))
    if not number:
        raise InputError(f"{poses}: lies in no round of the result tree; give its scores.csv")
    by = read_pose_selection(poses).chosen_with
    of = ({"preset": by} if by else {}) | ({} if number == 1 else {"t": number - 1})
    scores = related_folder(poses, "scored" if number == 1 else "round", **of) / "scores.csv"
    if not scores.is_file():
        raise InputError(f"{poses}: the scores by which they were chosen are missing ({scores}); make them again")
    return scores
