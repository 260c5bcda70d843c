"""Which files are a scene's photos, and which are their masks.

Rules name these files as inputs, registration reads them and `dav-gswt make` recognises them, all by `list_photos`.
The workflow calls it before the first job, so this module imports nothing heavy.
"""

import os
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from dav_gswt.errors import InputError
from dav_gswt.files import digest_files, locate_path
from dav_gswt.images.file_kinds import HEIF_SUFFIXES, RAW_SUFFIXES, SUFFIXES, Kind, detect_kind

PICTURES: tuple[Kind, ...] = ("photo", "heif", "raw")
MASK_FOLDERS = {"masks", "mask"}
MASK_ENDING = "_mask"
START = 4096  # bytes of a file that are compared before all of it
RESULT_MARK = "scene.yaml"  # a folder with it is a terrain that was made, not a folder of photos

Source = Path | str | Sequence[Path | str]  # a folder, a file, or several of them


@dataclass(frozen=True)
class PhotoListing:
    """The files of a scene's `folder`.

    where: the folder, in words. photos: by name, the path below the folder with slashes and composed letters (NFC).
    masks: of the photos that have one. files: the photos and all other files by kind, without masks. notes: what was
    skipped, a sentence each.
    """

    where: str
    photos: dict[str, Path]
    masks: dict[Path, Path]
    files: dict[Kind, list[Path]]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _File:
    """A file. name: below the folder that was given."""

    path: Path
    name: PurePosixPath
    kind: Kind


def list_photos(source: Source, masks: Path | str | None = None) -> PhotoListing:
    """The photos of a folder and its subfolders, of a file, or of several of these, in the order of their paths.

    A file's bytes say what it is. Hidden files, finished terrains and names that are no UTF-8 are skipped, and so are
    HEIC and raw photos beside a JPEG or PNG of the same name. Masks are NAME_mask.* beside the photo, pictures in a
    folder `masks` in the folder or beside a folder `images`, or those of the folder `masks` that is given.
    Raises: InputError: a folder or file is missing.
    """
    places = [Path(each) for each in ([source] if isinstance(source, Path | str) else source)]
    given = _list_files(Path(masks)) if masks else None
    groups, shared = defaultdict[Path, list[_File]](list), list[_File]()
    for place in places:
        files = _list_files(place)
        if len(places) > 1 and place.is_dir() and place.name.lower() in MASK_FOLDERS:
            shared += files
        else:
            groups[place if place.is_dir() else place.parent] += files
    photos, covers, kinds, notes = {}, {}, defaultdict(list), []
    for top, files in groups.items():
        named = [file for file in files if _is_utf8(file.name)]
        pictures, own_masks = _part_masks([file for file in named if file.kind in PICTURES])
        own_masks += shared + _list_masks_beside(top)
        kept = _drop_other_copies(pictures)
        matched = match_masks(kept, own_masks if given is None else given)
        if own_masks and not matched and given is None:
            notes.append(f"{own_masks[0].path}: a mask that belongs to no photo; name each as its photo")
        covers |= matched
        for file in kept:
            name = f"{top.name}/{file.name}" if len(groups) > 1 else str(file.name)
            while name in photos:
                name = f"_/{name}"
            photos[name] = file.path
        for file in kept + [file for file in named if file.kind not in PICTURES]:
            kinds[file.kind].append(file.path)
        if skipped := len(pictures) - len(kept):
            notes.append(
                f"HEIC and raw photos beside a JPEG or PNG of the same name, which is read, are skipped: {skipped}"
            )
        if unnamed := [file for file in files if not _is_utf8(file.name)]:
            name = os.fsencode(unnamed[0].name).decode(errors="backslashreplace")
            notes.append(f"files whose names are no UTF-8 are skipped: {len(unnamed)}, such as {name}; rename them")
    return PhotoListing(", ".join(map(str, places)), photos, covers, dict(kinds), tuple(notes))


def locate_source(folder: str | Sequence[str]) -> list[Path]:
    """Where a scene's `folder` is (`locate_path`)."""
    return [locate_path(each) for each in ([folder] if isinstance(folder, str) else folder)]


def drop_twins(photos: Mapping[str, Path]) -> tuple[dict[str, Path], dict[str, str]]:
    """The photos, each content once, and the others' names, each with the name of its twin that stays.

    The shortest file name stays: IMG_1.jpg, not the copy IMG_1 (1).jpg.
    """
    starts = {name: _digest(path, START) for name, path in photos.items()}
    alike = Counter(starts.values())
    first, twins = {}, {}
    for name in sorted(photos, key=lambda name: (len(PurePosixPath(name).name), name)):
        content = _digest(photos[name]) if alike[starts[name]] > 1 else None
        if content in first:
            twins[name] = first[content]
        elif content:
            first[content] = name
    return {name: path for name, path in photos.items() if name not in twins}, twins


def match_masks(photos: Sequence[_File], masks: Sequence[_File]) -> dict[Path, Path]:
    """The mask of each photo: of the same name (a.png, a.jpg.png or a_mask.png of a.jpg), in the same subfolder if
    there are several.
    """
    named = defaultdict(list)
    for mask in masks:
        named[mask.name.stem.removesuffix(MASK_ENDING)].append((_find_home(mask), mask.path))
    out = {}
    for photo in photos:
        found = named.get(photo.name.stem) or named.get(photo.name.name, [])
        same = [path for home, path in found if home == _find_home(photo)] or [path for _, path in found]
        if len(same) == 1:
            out[photo.path] = same[0]
    return out


def _find_home(file: _File) -> tuple[str, ...]:
    """The subfolder, without the folders that tell masks from photos."""
    return tuple(part for part in file.name.parent.parts if part.lower() not in MASK_FOLDERS | {"images"})


def _list_files(place: Path) -> list[_File]:
    """The files of a folder, or the file itself. Raises: InputError: there is none."""
    if place.is_file():
        return [_File(place, _name(place.name), _kind(place))]
    if not place.is_dir():
        raise InputError(f"{place}: there is no such folder of photos")
    return [_File(path, _name(path.relative_to(place)), _kind(path)) for path in sorted(_walk(place))]


def _walk(top: Path) -> Iterator[Path]:
    for folder, folders, names in os.walk(top):
        inside = Path(folder)
        folders[:] = [each for each in folders if each[0] != "." and not (inside / each / RESULT_MARK).is_file()]
        yield from (inside / name for name in names if name[0] != "." and (inside / name).is_file())


def _name(name: Path | str) -> PurePosixPath:
    return PurePosixPath(unicodedata.normalize("NFC", str(name)))


def _kind(path: Path) -> Kind:
    """The kind of a file. One that is named as a photo and is of no kind is a damaged photo, which is reported."""
    kind = detect_kind(path)
    return "photo" if kind == "other" and path.suffix.lower() in SUFFIXES | HEIF_SUFFIXES | RAW_SUFFIXES else kind


def _is_utf8(name: PurePosixPath) -> bool:
    try:
        return bool(str(name).encode())
    except UnicodeEncodeError:
        return False


def _part_masks(pictures: list[_File]) -> tuple[list[_File], list[_File]]:
    """Photos, and pictures that are masks: those in a folder of masks, and NAME_mask beside NAME."""
    stems = {file.name.with_suffix("") for file in pictures}

    def is_mask(file: _File) -> bool:
        name = file.name.with_suffix("")
        own = name.with_name(name.name.removesuffix(MASK_ENDING)) if name.name != MASK_ENDING else name
        return bool(MASK_FOLDERS & {p.lower() for p in file.name.parent.parts}) or own != name and own in stems

    return [file for file in pictures if not is_mask(file)], [file for file in pictures if is_mask(file)]


def _list_masks_beside(place: Path) -> list[_File]:
    """The masks that lie beside a folder `images`."""
    if place.name.lower() != "images":
        return []
    beside = [place.parent / name for name in sorted(MASK_FOLDERS) if (place.parent / name).is_dir()]
    return [file for folder in beside for file in _list_files(folder)]


def _drop_other_copies(pictures: list[_File]) -> list[_File]:
    """The photos without the HEIC and raw ones that a camera or phone wrote beside a JPEG."""
    plain = {file.name.with_suffix("") for file in pictures if file.kind == "photo"}
    return [file for file in pictures if file.kind == "photo" or file.name.with_suffix("") not in plain]


def _digest(path: Path, size: int = -1) -> str | None:
    """A digest of the first `size` bytes, or of all of them; None if the file cannot be read."""
    try:
        with path.open("rb") as file:
            return digest_files(path) if size < 0 else f"{path.stat().st_size} {file.read(size)!r}"
    except OSError:
        return None
