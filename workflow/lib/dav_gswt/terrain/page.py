"""Page folders: viewer, manifest and chunks together, ready for any web server."""

import hashlib
import os
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from dav_gswt.bundle.manifest import FORMAT, VERSION, Manifest
from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.terrain.class_rules import NOISE, Picture, apply_rule, warn_of_rule
from dav_gswt.terrain.heights import FlatSurface, HeightField, HeightMap, Hills
from dav_gswt.terrain.page_front import FRONT, STILL, Front, fill_front
from dav_gswt.terrain.page_story import SHEET, STORY
from dav_gswt.terrain.sphere import Sphere, require_plain_cover

SURFACE = "heights.bin"
INDEX = "index.html"
OWN_SCRIPTS = ("early.js", "worker/", "api/", "terrain_api.js")  # that are no modules of the page itself


def write_page(
    bundle_dir: Path | str,
    viewer_dir: Path | str,
    out_dir: Path | str,
    surface: HeightField | None = None,
    rule: Sequence[dict[str, Any]] = NOISE,
    front: Front | None = None,
) -> None:
    """Copy viewer, manifest and chunks to `out_dir`, atomically: an older page stays until the new one is complete.

    All files under `viewer_dir` are copied, and the chunks that the manifest names.

    Args:   surface: height field of the terrain (default: level ground), stored in the page's manifest as `heights`;
            the pixels of a height map are heights.bin, float32, little-endian, rows from the north. rule: the config's
            `classes`, stored as those of the page's manifest, its pictures beside it. front: name of the scene, line
            about it, first still and story (default: the viewer's own texts, no still, no story).
    Raises: InputError: the manifest is missing or of another version, a chunk is missing, has another size than the
            manifest says, or lies outside of the bundle; the viewer is incomplete; see also `describe_surface`,
            `class_rules.apply_rule`, `sphere.require_plain_cover`.
    """
    bundle, viewer, out = Path(bundle_dir), Path(viewer_dir), Path(out_dir)
    if not (viewer / INDEX).is_file():
        raise InputError(f"{viewer}: no viewer here (index.html is missing)")
    copies = [(path, str(path.relative_to(viewer))) for path in sorted(viewer.rglob("*")) if path.is_file()]
    copies += [(bundle / name, name) for name in list_chunks(bundle)]
    heights, pixels = describe_surface(surface or FlatSurface())
    value, pictures = replace_classes(read_json(bundle / MANIFEST), rule)
    require_plain_cover(heights["kind"], value.get("classes"), value.get("objects"))
    with atomic_folder(out) as part:
        for source, name in copies:
            _copy_file(source, part / name)
        modules = [name for _, name in copies if name.endswith(".js") and not name.startswith(OWN_SCRIPTS)]
        _write_index(part / INDEX, front, modules)
        if pixels:
            (part / SURFACE).write_bytes(pixels)
        for name, pixels in pictures.items():
            (part / name).write_bytes(pixels.tobytes())
        write_json(part / MANIFEST, value | {"heights": heights})


def _write_index(path: Path, front: Front | None, modules: list[str]) -> None:
    """Fill the copied index.html, and write the first still and the story beside it."""
    path.write_text(fill_front(path.read_text(encoding="utf-8"), front, modules), encoding="utf-8")
    if front:
        (path.parent / STILL).write_bytes(front.still)
        write_json(path.parent / FRONT, front.to_dict())
    if front and front.story:
        write_json(path.parent / STORY, front.story.value)
        (path.parent / SHEET).write_bytes(front.story.sheet)


def find_viewer(paths: Iterable[Path | str]) -> Path:
    """The folder of the viewer, given its files. Raises: InputError: there is no index.html among them."""
    for path in map(Path, paths):
        if path.name == INDEX:
            return path.parent
    raise InputError("the viewer's files hold no index.html")


def describe_surface(surface: HeightField) -> tuple[dict, bytes]:
    """The `heights` entry of the page's manifest, and the bytes of the height map's pixels (empty without one)."""
    if isinstance(surface, Hills):
        names = ("height", "wavelength", "octaves", "salt")
        return {"kind": "hills"} | {name: getattr(surface, name) for name in names}, b""
    if isinstance(surface, Sphere):
        return {"kind": "sphere", "radius": surface.radius, "cells": surface.cells}, b""
    if not isinstance(surface, HeightMap):
        return {"kind": "flat"}, b""
    rows, columns = surface.pixels.shape
    data = surface.pixels.astype("<f4").tobytes()
    entry = {"kind": "image", "file": SURFACE, "rows": rows, "columns": columns}
    entry |= {"width": surface.width, "beyond": surface.beyond, "bytes": len(data)}
    return entry | {"sha256": hashlib.sha256(data).hexdigest()}, data


def replace_classes(value: dict[str, Any], rule: Sequence[dict[str, Any]]) -> tuple[dict[str, Any], dict[str, Picture]]:
    """A manifest with the classes of the config's rule, and the pixels of its pictures. Raises: as `apply_rule`."""
    painted = any(entry["kind"] == "painted" for entry in rule)
    if "classes" not in value and not painted:
        warn_of_rule(rule)
        return value, {}
    made, pictures = apply_rule(Manifest.from_dict(value), rule)
    changed = made.to_dict()
    return value | {key: changed[key] for key in ("classes", "objects") if key in changed}, pictures


def list_chunks(bundle: Path) -> list[str]:
    """The chunk files that a bundle's manifest names, checked against the folder. Raises: InputError, as write_page."""
    manifest = read_json(bundle / MANIFEST)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT or manifest.get("version") != VERSION:
        raise InputError(f"{bundle / MANIFEST}: not a bundle of format {FORMAT!r}, version {VERSION}; make it again")
    try:
        holders = [*manifest["tiles"], *manifest.get("objects", [])]
        chunks = [(chunk["file"], chunk["bytes"]) for holder in holders for chunk in holder["chunks"]]
    except (KeyError, TypeError) as error:
        raise InputError(f"{bundle / MANIFEST}: incomplete tile table ({error}); make the bundle again") from error
    for name, size in chunks:
        if not _is_inside(name):
            raise InputError(f"{bundle / MANIFEST}: chunk {name!r} lies outside of the bundle")
        path = bundle / name
        if not path.is_file():
            raise InputError(f"{path}: this chunk is missing; make the bundle again")
        if path.stat().st_size != size:
            raise InputError(f"{path}: {path.stat().st_size} bytes instead of {size}; make the bundle again")
    return list(dict.fromkeys(name for name, _ in chunks))


def _is_inside(name) -> bool:
    """A plain relative path that cannot leave the folder it starts from."""
    return isinstance(name, str) and "\\" not in name and not {"..", "/", ""} & set(PurePosixPath(name).parts or ("",))


def _copy_file(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    with target.open("rb") as file:
        os.fsync(file.fileno())
