"""Scenes of candidate poses over the exemplar, coloured by their scores; the chosen ones are marked."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.inspect import result_files
from dav_gswt.inspect.field_scenes import compute_colours, make_solids, thin_field
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.photo_scenes import compute_bounds, make_frustum, outline_ground
from dav_gswt.inspect.scene import BLACK, ColourKey, Label, Layer, Scene, make_balls, make_bar, map_colours
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views import scores as tables
from dav_gswt.views.policies import HIGHEST, candidate_values
from dav_gswt.views.scores import Scores

BALL, CHOSEN_BALL, LETTER = 0.018, 0.03, 0.07  # radii and height, in radii of the hemisphere
TAKEN_COLOUR = (0, 0, 0)
FRUSTUM_DEPTH = 0.05  # flying heights: the pyramid of a photo that was taken


def build_scores(path: Path, options: ViewOptions) -> Scene:
    """scores.csv: with the poses that were chosen by it, where one round alone did or --poses names it."""
    poses = [options.poses] if options.poses else result_files.find_poses(path)
    return arrange_poses(path, poses[0] if len(poses) == 1 else None, options, len(poses))


def build_poses(path: Path, options: ViewOptions) -> Scene:
    """poses.json: with the scores that it was chosen by."""
    return arrange_poses(result_files.find_scores(path), path, options, 1)


def arrange_poses(path: Path, poses: Path | None, options: ViewOptions, rounds: int) -> Scene:
    """poses: the poses.json whose poses are marked. rounds: number of rounds that chose by these scores."""
    photos = result_files.find_photos(path)
    frame, table = read_scene_frame(photos / "ground.json"), tables.read_scores(path)
    if not len(table):
        raise InputError(f"{path}: no candidate is in it: none was left to choose from")
    label, values = choose_values(table, options.colour, result_files.decode_lam(poses or path))
    label, _, unit = label.partition(", ")
    bar = make_bar(label, values, most=HIGHEST)
    middle = frame.exemplar.centre
    positions = middle + np.array([pose_offset(pose) for pose in table.poses])
    radius = float(np.median(np.linalg.norm(positions - middle, axis=1)))
    chosen = _read_chosen(table, poses)
    rest = np.setdiff1d(np.arange(len(table)), chosen)
    tint = map_colours(values, bar)
    layers = [make_balls(positions[rest], BALL * radius, tint[rest]), *outline_ground(frame)]
    layers += _make_field_layers(path, options)
    labels = []
    if chosen:
        layers.append(make_balls(positions[chosen], CHOSEN_BALL * radius, tint[chosen]))
        stems = np.concatenate([middle[None], positions[chosen]]).astype(np.float32)
        layers.append(Layer("lines", stems, np.array([[0, i + 1] for i in range(len(chosen))]), BLACK, 2.0))
        up = np.array([0.0, 0.0, (CHOSEN_BALL + LETTER) * radius])
        labels = [Label(f"{i}", tuple(positions[k] + up), LETTER * radius) for i, k in enumerate(chosen, 1)]
    taken = _read_taken_cameras(path, photos)
    when = "taken before" if result_files.decode_round(path) else "taken at the start"
    for camera in taken:
        layers += make_frustum(camera, FRUSTUM_DEPTH * frame.flying_height, TAKEN_COLOUR, None)
    low, high = compute_bounds(frame, positions)
    keys = [ColourKey({f"{len(taken)} photos {when}": TAKEN_COLOUR})] * bool(taken)
    about = [_describe(table, chosen, poses, rounds), *([f"{label}: {unit}"] * bool(unit))]
    return Scene(str(poses or path), layers, low, high, about, labels, [bar, *keys])


def choose_values(table: Scores, name: str | None, lam: float) -> tuple[str, Float64[Array, "n"]]:
    """Name and values to colour by: a term, or what the round chose by. Raises: InputError: no such term."""
    if name is None:
        return candidate_values(table, lam)
    if name not in table.terms:
        raise InputError(f"--colour {name}: these poses have {', '.join(table.terms)}")
    return name, table.terms[name]


def _read_chosen(table: Scores, poses: Path | None) -> list[int]:
    if poses is None:
        return []
    content = read_json(poses)
    with result_files.wrap_errors(poses):
        names = [str(pose["name"]) for pose in content["poses"]]
    index = {name: i for i, name in enumerate(table.names)}
    if unknown := [name for name in names if name not in index]:
        raise InputError(f"{poses}: {unknown[0]} is not among the scored poses; give the poses of the round after")
    return [index[name] for name in names]


def _describe(table: Scores, chosen: list[int], poses: Path | None, rounds: int) -> str:
    if poses is None and rounds > 1:
        return f"{len(table)} candidates; {rounds} branches chose by these scores: --poses says whose are marked"
    if poses is None:
        return f"{len(table)} candidates; no round has chosen by these scores"
    by = "/".join(poses.resolve().parts[-3:])
    return f"{len(table)} candidates; {len(chosen)} chosen, numbered in order, by {by}"


def _make_field_layers(path: Path, options: ViewOptions) -> list[Layer]:
    """The field that was scored, if its file exists."""
    file = result_files.find_above(path, "field.ply", folders=2)
    if file is None:
        return []
    field = thin_field(read_field(file), options.most)
    return make_solids(field, compute_colours(field, "colour")) if len(field) else []


def _read_taken_cameras(path: Path, photos: Path) -> list[Camera]:
    """Cameras of the photos that the scored field was fitted to; none if some of their files are missing."""
    from dav_gswt.views import candidates  # here, not above: it loads pycolmap and the synthetic scenes

    captures = result_files.find_captures(path)
    views = result_files.find_above(path, "views.json")
    if views is None or not all((folder / "capture.json").is_file() for folder in captures):
        return []
    split = read_view_split(views)
    with result_files.wrap_errors(views):
        return candidates.read_captured_cameras(photos / "sparse", split, captures)
