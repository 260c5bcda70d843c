"""A finished terrain in Python, as its page shows it: the page folder has its surface and classes beside the tiles."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle.land_cover import ImageTerm
from dav_gswt.bundle.manifest import NAME
from dav_gswt.bundle.store import Bundle
from dav_gswt.errors import InputError, summarize_error
from dav_gswt.terrain.class_rules import Picture
from dav_gswt.terrain.endless import EndlessTerrain, terrain_from_fields
from dav_gswt.terrain.heights import MAX_SIDE, FlatSurface, HeightField, HeightMap, Hills
from dav_gswt.terrain.sphere import Sphere


def terrain_from_page(bundle: Bundle) -> EndlessTerrain:
    """The terrain of a page folder; of a bundle: on level ground, with the classes of its own noise.

    Raises: InputError: see `bundle.chunks.read_chunk`; a height map or a picture that is missing or damaged.
    """
    manifest, levels = bundle.manifest, range(len(bundle.manifest.levels))
    objects = [[bundle.object_chunk(k, level)[0] for level in levels] for k in range(len(manifest.objects or []))]
    surface = read_surface(bundle.folder, manifest.heights or {"kind": "flat"}, manifest.tile_side)
    return terrain_from_fields(bundle.fields(), manifest, surface, objects, read_pictures(bundle))


def read_surface(folder: Path, entry: Mapping[str, Any], side: float) -> HeightField:
    """The other end of `page.describe_surface`. side: of a tile.

    Raises: InputError: as `terrain_from_page`, or the entry is unknown.
    """
    try:
        if entry["kind"] == "hills":
            size = float(entry["height"]), float(entry["wavelength"])
            return Hills(*size, int(entry["octaves"]), int(entry["salt"]))
        if entry["kind"] == "image":
            return _read_height_map(folder, entry, int(entry["rows"]), int(entry["columns"]), float(entry["width"]))
        if entry["kind"] == "sphere":
            return Sphere(float(entry["radius"]), side, int(entry["cells"]))
    except (KeyError, TypeError, ValueError) as error:
        why = summarize_error(error)
        raise InputError(f"{folder / NAME}: heights make no sense ({why}); make the page again") from error
    return FlatSurface()


def _read_height_map(folder: Path, entry: Mapping[str, Any], rows: int, columns: int, width: float) -> HeightMap:
    if not (0 < rows <= MAX_SIDE and 0 < columns <= MAX_SIDE and 0 < width < np.inf):
        raise ValueError("a size is out of range")
    data = _read_exactly(folder, entry["file"], 4 * rows * columns, entry.get("sha256"))
    pixels = np.frombuffer(data, "<f4").reshape(rows, columns).astype(np.float32)
    if not np.isfinite(pixels).all():
        raise InputError(f"{folder / entry['file']}: a height is not finite; make the page again")
    return HeightMap(pixels, width, entry.get("beyond", "mirror"))


def read_pictures(bundle: Bundle) -> dict[str, Picture]:
    """The pictures of a page's classes, by file. Raises: InputError: as `terrain_from_page`."""
    pictures = {}
    for term in bundle.manifest.classes.rule if bundle.manifest.classes else []:
        if isinstance(term, ImageTerm):
            data = _read_exactly(bundle.folder, term.file, term.rows * term.columns, term.sha256)
            pictures[term.file] = np.frombuffer(data, np.uint8).reshape(term.rows, term.columns)
    return pictures


def _read_exactly(folder: Path, name: str, size: int, digest: str | None) -> bytes:
    """The bytes of a file of this size. Raises: InputError: it is missing, has another size or other content."""
    path = folder / name
    if Path(name).name != name:
        raise InputError(f"{folder / NAME}: {name!r} does not lie beside it; make the page again")
    if not path.is_file():
        raise InputError(f"{path}: missing; make the page again")
    if path.stat().st_size != size:
        raise InputError(f"{path}: {path.stat().st_size} bytes instead of {size}; make the page again")
    data = path.read_bytes()
    if digest is not None and hashlib.sha256(data).hexdigest() != digest:
        raise InputError(f"{path}: damaged (its SHA-256 is not the manifest's); make the page again")
    return data
