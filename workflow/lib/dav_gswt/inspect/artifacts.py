"""Recognise artefacts by their paths, and build their scenes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.inspect import field_scenes, map_scenes, photo_scenes, pose_scenes, tile_scenes
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import Scene


@dataclass(frozen=True)
class ArtifactKind:
    """build: makes the scene. options: of the command line that it has. whole: build takes the folder of the file."""

    build: Callable[[Path, ViewOptions], Scene]
    options: tuple[str, ...] = ()
    whole: bool = False


FIELD = ArtifactKind(field_scenes.build_field, ("colour",))
BY_NAME = {  # in the order in which a folder is searched for them
    "materials.json": ArtifactKind(map_scenes.build_materials, ("channel",), whole=True),
    "levels.json": ArtifactKind(field_scenes.build_levels_scene, ("colour", "level"), whole=True),
    "seams.json": ArtifactKind(tile_scenes.build_tiles, ("colour", "level"), whole=True),
    "davgswt.json": ArtifactKind(tile_scenes.build_bundle, ("colour", "level"), whole=True),
    "ground.json": ArtifactKind(photo_scenes.build_photos, whole=True),
    "capture.json": ArtifactKind(photo_scenes.build_capture),
    "field.ply": FIELD,
    "scores.csv": ArtifactKind(pose_scenes.build_scores, ("colour", "poses")),
    "poses.json": ArtifactKind(pose_scenes.build_poses, ("colour",)),
    "views.json": ArtifactKind(photo_scenes.build_split),
    "maps.npz": ArtifactKind(map_scenes.build_pose_maps, ("colour", "part", "channel")),
}
BY_SUFFIX = {".ply": FIELD, ".exr": ArtifactKind(map_scenes.build_map, ("part", "channel"))}
KNOWN = (
    "fields (.ply, levels/), materials/, tiles_*/ and bundle_*/, photos/, views.json, capture/, scores.csv, "
    "poses.json, maps.npz and .exr"
)


def build_scene(path: Path, options: ViewOptions) -> Scene:
    """The scene of an artefact. Raises: InputError: an unknown kind of artefact, or a damaged one."""
    path, kind = recognise(path)
    options.reject_others(path, *kind.options)
    return kind.build(path.parent if kind.whole else path, options)


def recognise(path: Path) -> tuple[Path, ArtifactKind]:
    """The file of an artefact and its kind. Raises: InputError: there is none, or it is of an unknown kind."""
    if path.is_dir():
        inside = next((path / name for name in BY_NAME if (path / name).is_file()), None)
        if inside is None and (path / "labels.npz").is_file():
            inside = path.parent / "seams.json"  # tiles/, which its seams.json lies beside
        if inside is None:
            raise InputError(f"{path}: a folder of nothing that is understood; understood are {KNOWN}")
        return inside, BY_NAME[inside.name]
    if not path.is_file():
        raise InputError(f"{path}: there is no such file or folder")
    if path.name == "labels.npz":
        return path.parents[1] / "seams.json", BY_NAME["seams.json"]
    kind = BY_NAME.get(path.name) or BY_SUFFIX.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: not understood; understood are {KNOWN}")
    return path, kind
