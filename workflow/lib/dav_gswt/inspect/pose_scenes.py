"""Candidate poses over the exemplar, coloured by what the scores say of them; the chosen ones are marked."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.inspect import result_files
from dav_gswt.inspect.field_scenes import compute_colours, make_solids, thin_field
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.photo_scenes import compute_bounds, make_frustum, outline_ground
from dav_gswt.inspect.scene import BLACK, ColourKey, Label, Layer, Scene, make_balls, make_bar, map_colours
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views import scores as tables
from dav_gswt.views.score_colours import HIGHEST, candidate_values
from dav_gswt.views.scores import Scores

BALL, CHOSEN, LETTER = 0.018, 0.03, 0.07  # radii and height, in radii of the hemisphere
TAKEN_COLOUR = (0, 0, 0)
FRUSTUM_DEPTH = 0.05  # flying heights: the pyramid of a photo that was taken


def build_scores(path: Path, asked: ViewOptions) -> Scene:
    """scores.csv: with the poses that were chosen by it, where one round alone did or --poses names it."""
    found = [asked.poses] if asked.poses else result_files.find_poses(path)
    return arrange_poses(path, found[0] if len(found) == 1 else None, asked, len(found))


def build_poses(path: Path, asked: ViewOptions) -> Scene:
    """poses.json: with the scores that it was chosen by."""
    return arrange_poses(result_files.find_scores(path), path, asked, 1)


def arrange_poses(path: Path, poses: Path | None, asked: ViewOptions, rounds: int) -> Scene:
    """rounds: that chose by these scores."""
    photos = result_files.find_photos(path)
    if photos is None:
        raise InputError(
            f"{path}: its scene's photos/ground.json is in no folder above it; leave it in its result tree"
        )
    frame, table = read_scene_frame(photos / "ground.json"), tables.read_scores(path)
    if not len(table):
        raise InputError(f"{path}: no candidate is in it: none was left to choose from")
    label, values = choose_values(table, asked.colour, result_files.parse_lam(poses or path))
    label, _, unit = label.partition(", ")
    bar = make_bar(label, values, most=HIGHEST)
    middle = frame.exemplar.centre
    at = middle + np.array([pose_offset(pose) for pose in table.poses])
    radius = float(np.median(np.linalg.norm(at - middle, axis=1)))
    chosen = _read_chosen(table, poses)
    rest = np.setdiff1d(np.arange(len(table)), chosen)
    tint = map_colours(values, bar)
    layers = [make_balls(at[rest], BALL * radius, tint[rest]), *outline_ground(frame), *_field_layers(path, asked)]
    words = []
    if chosen:
        layers.append(make_balls(at[chosen], CHOSEN * radius, tint[chosen]))
        stems = np.concatenate([middle[None], at[chosen]]).astype(np.float32)
        layers.append(Layer("lines", stems, np.array([[0, i + 1] for i in range(len(chosen))]), BLACK, 2.0))
        up = np.array([0.0, 0.0, (CHOSEN + LETTER) * radius])
        words = [Label(f"{i}", tuple(at[k] + up), LETTER * radius) for i, k in enumerate(chosen, 1)]
    taken, known = _taken_cameras(path, photos), "taken before" if parse_round_before(path) else "taken at the start"
    for camera in taken:
        layers += make_frustum(camera, FRUSTUM_DEPTH * frame.flying_height, TAKEN_COLOUR, None)
    low, high = compute_bounds(frame, at)
    keys = [ColourKey({f"{len(taken)} photos {known}": TAKEN_COLOUR})] * bool(taken)
    about = [_describe(table, chosen, poses, rounds), *([f"{label}: {unit}"] * bool(unit))]
    return Scene(str(poses or path), layers, low, high, about, words, [bar, *keys])


def choose_values(table: Scores, name: str | None, lam: float) -> tuple[str, Float64[Array, "n"]]:
    """What to colour by, in words and numbers: a term, or what the round chose by. Raises: InputError: no such term."""
    if name is None:
        return candidate_values(table, lam)
    if name not in table.terms:
        raise InputError(f"--colour {name}: these poses have {', '.join(table.terms)}")
    return name, table.terms[name]


def _read_chosen(table: Scores, poses: Path | None) -> list[int]:
    if poses is None:
        return []
    told = read_json(poses)
    with result_files.blaming(poses):
        names = [str(pose["name"]) for pose in told["poses"]]
    index = {name: i for i, name in enumerate(table.names)}
    if strange := [name for name in names if name not in index]:
        raise InputError(f"{poses}: {strange[0]} is not among the scored poses; give the poses of the round after")
    return [index[name] for name in names]


def _describe(table: Scores, chosen: list[int], poses: Path | None, rounds: int) -> str:
    if poses is None and rounds > 1:
        return f"{len(table)} candidates; {rounds} branches chose by these scores: --poses says whose are marked"
    if poses is None:
        return f"{len(table)} candidates; no round has chosen by these scores"
    by = "/".join(poses.resolve().parts[-3:])
    return f"{len(table)} candidates; {len(chosen)} chosen, numbered in order, by {by}"


def parse_round_before(path: Path) -> int:
    """The round that left the scores; 0: the coarse field."""
    return result_files.parse_round(path) or 0


def _field_layers(path: Path, asked: ViewOptions) -> list[Layer]:
    """The field that was scored, where it lies beside its scores."""
    path = path.resolve()
    found = (
        path.parent / "field.ply" if result_files.parse_round(path) is not None else path.parent.parent / "field.ply"
    )
    if not found.is_file():
        return []
    some = thin_field(read_field(found), asked.most)
    return make_solids(some, compute_colours(some, "colour")) if len(some) else []


def _taken_cameras(path: Path, photos: Path) -> list:
    """Cameras of the photos that the scored field was made of, as far as they are there."""
    from dav_gswt.views import candidates  # here, not above: it loads pycolmap and the synthetic scenes

    path = path.resolve()
    up = next((p for p in path.parents if (p / "views.json").is_file()), None)
    captures = [path.parents[1] / f"iter{t}" / "capture" for t in range(1, parse_round_before(path) + 1)]
    if up is None or not all((folder / "capture.json").is_file() for folder in captures):
        return []
    split = read_view_split(up / "views.json")
    with result_files.blaming(up / "views.json"):
        return candidates.read_captured_cameras(photos / "sparse", split, captures)
