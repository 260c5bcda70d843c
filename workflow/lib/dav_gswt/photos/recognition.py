"""What somebody brings, recognised by what is in it: photos, a video, a splat, or another program's project."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dav_gswt.errors import InputError
from dav_gswt.images.file_kinds import Kind, advise_conversion, detect_kind

LEAST_PHOTOS = 3
PICTURES: tuple[Kind, ...] = ("photo", "heif", "raw")
SPLATS: tuple[Kind, ...] = ("ply", "spz", "splat", "ksplat", "sog")
MASK_FOLDERS = {"masks", "mask"}
COLMAP_FILES = ("cameras.bin", "cameras.txt")
OPENSFM_FILES = ("opensfm/reconstruction.json", "reconstruction.json")
SPLAT_PROPERTY = re.compile(rb"property (float|float32|double|float64) f_dc_0\b")  # a .ply that holds Gaussians
PACKED_PROPERTY = b"packed_position"
PLY_HEAD = 8192


@dataclass(frozen=True)
class Recognised:
    """An input. entry: the keys of its scene. about: what it is, in words. name: of the scene."""

    entry: dict[str, Any]
    about: str
    name: str


@dataclass
class _Found:
    """The files of a folder and its subfolders, by kind. Hidden files and folders of masks are left out."""

    files: dict[Kind, list[Path]] = field(default_factory=dict)
    models: list[tuple[str, Path]] = field(default_factory=list)  # program, and what it wrote
    masks: Path | None = None

    def list(self, *kinds: Kind) -> list[Path]:
        return [path for kind in kinds for path in self.files.get(kind, [])]


def recognize_input(paths: Sequence[Path], model: Path | None = None) -> Recognised:
    """What the paths are. model: a camera model that lies elsewhere.

    Raises: InputError: nothing is there, nothing is understood, or it is two things at once.
    """
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: there is no such file or folder")
    if len(paths) == 1:
        name = name_scene(paths[0])
        return _recognize_folder(paths[0], name, model) if paths[0].is_dir() else _recognize_file(paths[0], name)
    kinds = {detect_kind(path) for path in paths if path.is_file()}
    if other := [path for path in paths if path.is_file() and detect_kind(path) not in PICTURES]:
        raise InputError(f"{other[0]}: is no photo; several inputs must be photos or folders of photos")
    photos = [file for path in paths for file in (_search(path).list(*PICTURES) if path.is_dir() else [path])]
    entry = {"kind": "photos", "folder": [str(path.resolve()) for path in paths]}
    _require_photos(photos, ", ".join(path.name for path in paths))
    return Recognised(entry | _name_model(model), _describe_photos(photos, kinds), name_scene(paths[0]))


def name_scene(path: Path) -> str:
    """A scene's name after a file or folder: letters, digits, - and _, from a letter."""
    stem = path.resolve().stem if path.is_file() else path.resolve().name
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in stem).strip("_-") or "terrain"
    return plain if plain[0].isalpha() else f"scene_{plain}"


def _recognize_file(path: Path, name: str) -> Recognised:
    kind = detect_kind(path)
    if kind == "video":
        return Recognised({"kind": "photos", "folder": str(path.resolve())}, "a video", name)
    if kind in SPLATS:
        return _recognize_splat(path, name, kind)
    if kind in PICTURES:
        raise InputError(f"{path}: is one photo; name the folder of all of them (at least {LEAST_PHOTOS}, better 20)")
    raise InputError(f"{path}: not understood; bring photos, a video (MP4, MOV), a splat (.ply) or a folder of them")


def _recognize_splat(path: Path, name: str, kind: Kind) -> Recognised:
    if kind == "ply" and not holds_gaussians(path):
        raise InputError(f"{path}: a mesh or point cloud, without Gaussians; bring the photos it was made from")
    if advice := advise_conversion(path, kind):
        raise InputError(f"{path}: {advice}")
    return Recognised({"kind": "field", "field": str(path.resolve())}, f"a finished splat (.{kind})", name)


def holds_gaussians(path: Path) -> bool:
    """Whether a .ply names the properties of Gaussians, plain or packed."""
    with path.open("rb") as file:
        head = file.read(PLY_HEAD)
    return SPLAT_PROPERTY.search(head) is not None or PACKED_PROPERTY in head


def _recognize_folder(folder: Path, name: str, model: Path | None) -> Recognised:
    if advice := advise_conversion(folder, "sog" if (folder / "means_l.webp").is_file() else "other"):
        raise InputError(f"{folder}: {advice}")
    found = _search(folder)
    photos, videos = found.list(*PICTURES), found.list("video")
    splats = [path for path in found.list(*SPLATS) if path.suffix.lower() != ".ply" or holds_gaussians(path)]
    models = [("the model", model)] if model else found.models
    if len(models) > 1:
        names = " and ".join(f"{program} ({path.relative_to(folder)})" for program, path in models)
        raise InputError(f"{folder}: has cameras of {names}; say which with --model PATH")
    if models and not photos:
        raise InputError(f"{folder}: has cameras of {models[0][0]}, but no photos; its photos belong in the folder too")
    if models:
        splats = []  # a project's own results
    things = {"photos": photos, "a video": videos, "a splat": splats}
    there = [f"{what} ({paths[0].relative_to(folder)})" for what, paths in things.items() if paths]
    if len(there) > 1:
        raise InputError(f"{folder}: is several things at once, {' and '.join(there)}; name the one that is meant")
    if videos or splats:
        if len(videos or splats) > 1:
            raise InputError(f"{folder}: has several, {', '.join(p.name for p in (videos or splats)[:3])}; name one")
        return _recognize_file((videos or splats)[0], name)
    _require_photos(photos, str(folder))
    entry = {"kind": "photos", "folder": str(folder.resolve())}
    about = _describe_photos(photos, set(found.files))
    if models:
        program, place = models[0]
        entry, about = entry | _name_model(place), f"{about} with cameras of {program}"
        images = folder / "images"
        entry["folder"] = str((images if images.is_dir() and program != "nerfstudio" else folder).resolve())
    if found.masks:
        entry, about = entry | {"masks": str(found.masks.resolve())}, f"{about} and masks"
    return Recognised(entry, about, name)


def _search(folder: Path) -> _Found:
    found = _Found()
    if any((folder / name).is_file() for name in COLMAP_FILES):
        found.models.append(("COLMAP", folder))
    else:
        sparse = [folder / "sparse", *sorted((folder / "sparse").glob("[0-9]*"))]
        models = [place for place in sparse if any((place / name).is_file() for name in COLMAP_FILES)]
        found.models += [("COLMAP", place) for place in models[:1]]
    found.models += [("nerfstudio", folder / "transforms.json")] * (folder / "transforms.json").is_file()
    opensfm = [folder / name for name in OPENSFM_FILES if (folder / name).is_file()]
    found.models += [("OpenSfM", place) for place in opensfm[:1]]
    inside = folder / "images" if found.models and (folder / "images").is_dir() else folder
    for path in sorted(inside.rglob("*")):
        parts = path.relative_to(inside).parts
        if any(part.startswith(".") for part in parts) or not path.is_file():
            continue
        if MASK_FOLDERS & {part.lower() for part in parts[:-1]}:
            continue
        found.files.setdefault(detect_kind(path), []).append(path)
    found.masks = next((folder / name for name in sorted(MASK_FOLDERS) if (folder / name).is_dir()), None)
    return found


def _name_model(model: Path | None) -> dict[str, str]:
    return {"model": str(model.resolve())} if model else {}


def _require_photos(photos: list[Path], where: str) -> None:
    if len(photos) < LEAST_PHOTOS:
        had = f"only {len(photos)} photos" if photos else "no photos"
        raise InputError(f"{where}: {had}; at least {LEAST_PHOTOS} overlapping photos are needed, better 20")


def _describe_photos(photos: list[Path], kinds: set[Kind]) -> str:
    extra = [name for kind, name in (("heif", "HEIC"), ("raw", "raw")) if kind in kinds]
    return f"{len(photos)} photos" + (f" ({' and '.join(extra)} among them)" if extra else "")
