"""Which artefact a path is, by its name and by what lies in a folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.inspect import fields, maps, sites, spheres, tiles
from dav_gswt.inspect.options import Asked
from dav_gswt.inspect.scene import Scene


@dataclass(frozen=True)
class Kind:
    """show: makes the scene. options: of the command line that it knows. whole: it is given the folder of the file."""

    show: Callable[[Path, Asked], Scene]
    options: tuple[str, ...] = ()
    whole: bool = False


FIELD = Kind(fields.show, ("colour",))
NAMED = {  # in the order in which a folder is searched for them
    "levels.json": Kind(fields.show_levels, ("colour", "level"), whole=True),
    "seams.json": Kind(tiles.show, ("colour", "level"), whole=True),
    "davgswt.json": Kind(tiles.show_bundle, ("colour", "level"), whole=True),
    "ground.json": Kind(sites.show, whole=True),
    "capture.json": Kind(sites.show_captured),
    "field.ply": FIELD,
    "scores.csv": Kind(spheres.show, ("colour", "poses")),
    "poses.json": Kind(spheres.show_chosen, ("colour",)),
    "views.json": Kind(sites.show_split),
    "maps.npz": Kind(maps.show_posed, ("colour", "part", "channel")),
}
BY_SUFFIX = {".ply": FIELD, ".exr": Kind(maps.show, ("part", "channel"))}
UNDERSTOOD = (
    "fields (.ply, levels/), tiles_*/ and bundle_*/, photos/, views.json, capture/, scores.csv, poses.json, maps.npz "
    "and .exr"
)


def scene_of(path: Path, asked: Asked) -> Scene:
    """The scene of an artefact. Raises: InputError: nothing that is understood, or damaged."""
    path, kind = recognised(path)
    asked.refuse(path, *kind.options)
    return kind.show(path.parent if kind.whole else path, asked)


def recognised(path: Path) -> tuple[Path, Kind]:
    """The file that stands for a path, and what it is. Raises: InputError: none."""
    if path.is_dir():
        inside = next((path / name for name in NAMED if (path / name).is_file()), None)
        if inside is None and (path / "labels.npz").is_file():
            inside = path.parent / "seams.json"  # tiles/, which its seams.json lies beside
        if inside is None:
            raise InputError(f"{path}: a folder of nothing that is understood; understood are {UNDERSTOOD}")
        return inside, NAMED[inside.name]
    if not path.is_file():
        raise InputError(f"{path}: there is no such file or folder")
    if path.name == "labels.npz":
        return path.parents[1] / "seams.json", NAMED["seams.json"]
    kind = NAMED.get(path.name) or BY_SUFFIX.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: not understood; understood are {UNDERSTOOD}")
    return path, kind
