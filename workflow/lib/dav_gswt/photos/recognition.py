"""What somebody brings, recognised by what is in it: photos, a video, a splat, or another program's project."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dav_gswt.errors import InputError
from dav_gswt.images.file_kinds import Kind, advise_conversion, detect_kind
from dav_gswt.photos.photo_listing import PICTURES, PhotoListing, list_photos

LEAST_PHOTOS = 3
SPLATS: tuple[Kind, ...] = ("ply", "spz", "spz4", "splat", "ksplat", "sog")
COLMAP_PARTS = ("cameras", "images")
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
    if other := [path for path in paths if path.is_file() and detect_kind(path) not in PICTURES]:
        raise InputError(f"{other[0]}: is no photo; several inputs must be photos or folders of photos")
    listing = list_photos([path.resolve() for path in paths])
    _require_photos(listing)
    entry = {"kind": "photos", "folder": [str(path.resolve()) for path in paths]}
    return Recognised(entry | _name_model(model), _describe_photos(listing), name_scene(paths[0]))


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
    found_models = _find_models(folder)
    listing = list_photos(folder / "images" if found_models and (folder / "images").is_dir() else folder)
    photos, files = list(listing.photos.values()), listing.files
    stills = {path.with_suffix("") for path in photos}
    videos = [path for path in files.get("video", []) if path.with_suffix("") not in stills]  # no live photo
    splats = [path for kind in SPLATS for path in files.get(kind, []) if kind != "ply" or holds_gaussians(path)]
    models = [("the model", model)] if model else found_models
    if len(models) > 1:
        names = " and ".join(f"{program} ({path.relative_to(folder)})" for program, path in models)
        raise InputError(f"{folder}: has cameras of {names}; say which with --model PATH")
    if models and not photos:
        raise InputError(
            f"{folder}: has cameras of {models[0][0]}, but no photos; put them into its folder images, or name their "
            f"folder and the cameras: dav-gswt make PHOTOS --model {models[0][1]}"
        )
    if models:
        splats, videos = [], []  # a project's own results, and what its photos were taken from
    things = {"photos": photos, "a video": videos, "a splat": splats}
    there = [f"{what} ({paths[0].relative_to(folder)})" for what, paths in things.items() if paths]
    if len(there) > 1:
        raise InputError(f"{folder}: is several things at once, {' and '.join(there)}; name the one that is meant")
    if videos or splats:
        if len(videos or splats) > 1:
            raise InputError(f"{folder}: has several, {', '.join(p.name for p in (videos or splats)[:3])}; name one")
        return _recognize_file((videos or splats)[0], name)
    _require_photos(listing)
    entry = {"kind": "photos", "folder": str(folder.resolve())}
    about = _describe_photos(listing)
    if models:
        program, place = models[0]
        entry, about = entry | _name_model(place), f"{about} with cameras of {program}"
        images = folder / "images"
        entry["folder"] = str((images if images.is_dir() and program != "nerfstudio" else folder).resolve())
    if listing.masks:
        about += " and masks"
    return Recognised(entry, about, name)


def find_colmap_folder(folder: Path) -> Path | None:
    """The folder at or below this one that holds a COLMAP model, if any; of several the largest."""
    below = sorted(folder.glob("[0-9]*")), sorted((folder / "sparse").glob("[0-9]*"))
    places = [folder, folder / "sparse", *below[0], *below[1]]
    found = [place for place in places if find_colmap_ending(place)]
    return max(found, key=lambda place: (place / f"images.{find_colmap_ending(place)}").stat().st_size, default=None)


def find_colmap_ending(folder: Path) -> str | None:
    """Whether the files of a COLMAP model in a folder are `bin` or `txt`; None: there is none."""
    kinds = (kind for kind in ("bin", "txt") if all((folder / f"{part}.{kind}").is_file() for part in COLMAP_PARTS))
    return next(kinds, None)


def _find_models(folder: Path) -> list[tuple[str, Path]]:
    """The camera models in a folder: the program, and what it wrote."""
    colmap, nerfstudio = find_colmap_folder(folder), folder / "transforms.json"
    models = [("COLMAP", colmap)] if colmap else []
    models += [("nerfstudio", nerfstudio)] if nerfstudio.is_file() else []
    opensfm = [folder / name for name in OPENSFM_FILES if (folder / name).is_file()]
    return models + [("OpenSfM", place) for place in opensfm[:1]]


def _name_model(model: Path | None) -> dict[str, str]:
    return {"model": str(model.resolve())} if model else {}


def _require_photos(listing: PhotoListing) -> None:
    count = len(listing.photos)
    if count < LEAST_PHOTOS:
        had = f"only {count} photos" if count else "no photos"
        notes = "".join(f" ({note})" for note in listing.notes)
        raise InputError(
            f"{listing.where}: {had}{notes}; at least {LEAST_PHOTOS} overlapping photos are needed, better 20"
        )


def _describe_photos(listing: PhotoListing) -> str:
    extra = ["HEIC"] * ("heif" in listing.files) + ["raw"] * ("raw" in listing.files)
    return f"{len(listing.photos)} photos" + (f" ({' and '.join(extra)} among them)" if extra else "")
