"""Candidate poses over the exemplar, coloured by what the scores say of them; the chosen ones are marked."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry import poses as places
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.inspect import beside
from dav_gswt.inspect.fields import colours, solid, thinned
from dav_gswt.inspect.options import Asked
from dav_gswt.inspect.scene import INK, Keys, Layer, Scene, Word, balls, bar_over, coloured
from dav_gswt.inspect.sites import bounds, ground, looking
from dav_gswt.study.views.sphere import HIGHEST, candidate_values
from dav_gswt.views import scores as tables
from dav_gswt.views.scores import Scores

BALL, CHOSEN, LETTER = 0.018, 0.03, 0.07  # radii and height, in radii of the hemisphere
TAKEN = (0, 0, 0)
REACH = 0.05  # flying heights: the pyramid of a photo that was taken


def show(path: Path, asked: Asked) -> Scene:
    """scores.csv: with the poses that were chosen by it, where one round alone did or --poses names it."""
    found = [asked.poses] if asked.poses else beside.poses_by(path)
    return of_scores(path, found[0] if len(found) == 1 else None, asked, len(found))


def show_chosen(path: Path, asked: Asked) -> Scene:
    """poses.json: with the scores that it was chosen by."""
    return of_scores(beside.scores_behind(path), path, asked, 1)


def of_scores(path: Path, poses: Path | None, asked: Asked, rounds: int) -> Scene:
    """rounds: that chose by these scores."""
    photos = beside.photos_of(path)
    if photos is None:
        raise InputError(
            f"{path}: its scene's photos/ground.json is in no folder above it; leave it in its result tree"
        )
    frame, table = read_scene_frame(photos / "ground.json"), tables.read_scores(path)
    if not len(table):
        raise InputError(f"{path}: no candidate is in it: none was left to choose from")
    label, values = shaded(table, asked.colour, beside.lam_of(poses or path))
    label, _, unit = label.partition(", ")
    bar = bar_over(label, values, most=HIGHEST)
    middle = places.middle(frame)
    at = middle + np.array([places.place(pose) for pose in table.poses])
    radius = float(np.median(np.linalg.norm(at - middle, axis=1)))
    chosen = _chosen(table, poses)
    rest = np.setdiff1d(np.arange(len(table)), chosen)
    tint = coloured(values, bar)
    layers = [balls(at[rest], BALL * radius, tint[rest]), *ground(frame), *_field(path, asked)]
    words = []
    if chosen:
        layers.append(balls(at[chosen], CHOSEN * radius, tint[chosen]))
        stems = np.concatenate([middle[None], at[chosen]]).astype(np.float32)
        layers.append(Layer("lines", stems, np.array([[0, i + 1] for i in range(len(chosen))]), INK, 2.0))
        up = np.array([0.0, 0.0, (CHOSEN + LETTER) * radius])
        words = [Word(f"{i}", tuple(at[k] + up), LETTER * radius) for i, k in enumerate(chosen, 1)]
    taken, known = _taken(path, photos), "taken before" if round_before(path) else "taken at the start"
    for camera in taken:
        layers += looking(camera, REACH * frame.flying_height, TAKEN, None)
    low, high = bounds(frame, at)
    keys = [Keys({f"{len(taken)} photos {known}": TAKEN})] * bool(taken)
    about = [_about(table, chosen, poses, rounds), *([f"{label}: {unit}"] * bool(unit))]
    return Scene(str(poses or path), layers, low, high, about, words, [bar, *keys])


def shaded(table: Scores, name: str | None, lam: float) -> tuple[str, Float64[Array, "n"]]:
    """What to colour by, in words and numbers: a term, or what the round chose by. Raises: InputError: no such term."""
    if name is None:
        return candidate_values(table, lam)
    if name not in table.terms:
        raise InputError(f"--colour {name}: these poses have {', '.join(table.terms)}")
    return name, table.terms[name]


def _chosen(table: Scores, poses: Path | None) -> list[int]:
    if poses is None:
        return []
    told = read_json(poses)
    with beside.told_by(poses):
        names = [str(pose["name"]) for pose in told["poses"]]
    index = {name: i for i, name in enumerate(table.names)}
    if strange := [name for name in names if name not in index]:
        raise InputError(f"{poses}: {strange[0]} is not among the scored poses; give the poses of the round after")
    return [index[name] for name in names]


def _about(table: Scores, chosen: list[int], poses: Path | None, rounds: int) -> str:
    if poses is None and rounds > 1:
        return f"{len(table)} candidates; {rounds} branches chose by these scores: --poses says whose are marked"
    if poses is None:
        return f"{len(table)} candidates; no round has chosen by these scores"
    by = "/".join(poses.resolve().parts[-3:])
    return f"{len(table)} candidates; {len(chosen)} chosen, numbered in order, by {by}"


def round_before(path: Path) -> int:
    """The round that left the scores; 0: the coarse field."""
    return beside.round_of(path) or 0


def _field(path: Path, asked: Asked) -> list[Layer]:
    """The field that was scored, where it lies beside its scores."""
    path = path.resolve()
    found = path.parent / "field.ply" if beside.round_of(path) is not None else path.parent.parent / "field.ply"
    if not found.is_file():
        return []
    some = thinned(read_field(found), asked.most)
    return solid(some, colours(some, "colour")) if len(some) else []


def _taken(path: Path, photos: Path) -> list:
    """Cameras of the photos that the scored field was made of, as far as they are there."""
    from dav_gswt.views import candidates  # here, not above: it loads pycolmap and the synthetic scenes

    path = path.resolve()
    up = next((p for p in path.parents if (p / "views.json").is_file()), None)
    captures = [path.parents[1] / f"iter{t}" / "capture" for t in range(1, round_before(path) + 1)]
    if up is None or not all((folder / "capture.json").is_file() for folder in captures):
        return []
    split = read_json(up / "views.json")
    with beside.told_by(up / "views.json"):
        return candidates.read_captured_cameras(photos / "sparse", split, captures)
