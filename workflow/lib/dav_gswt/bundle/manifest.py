"""davgswt.json: the only contract between the pipeline and a viewer, checked against its schema on write and read."""

import json
from pathlib import Path

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from dav_gswt.bundle.chunks import chunk_size
from dav_gswt.errors import InputError
from dav_gswt.files import read_json

NAME = "davgswt.json"
FORMAT, VERSION = "davgswt", 2
MAX_BYTES = 1 << 26  # bytes of a manifest


def check_manifest(manifest, schema: Path | str, name: Path | str = NAME) -> None:
    """Check a manifest against the JSON schema and against itself.

    Raises: InputError: the key and what is wrong with it, or tables that contradict one another.
    """
    rules = json.loads(Path(schema).read_text(encoding="utf-8"))
    if error := best_match(Draft202012Validator(rules).iter_errors(manifest)):
        key = ".".join(str(p) for p in error.absolute_path) or "manifest"
        raise InputError(f"{name}: {key}: {error.message}; make the bundle again")
    for fault in _find_faults(manifest):
        raise InputError(f"{name}: {fault}; make the bundle again")


def _find_faults(manifest: dict):
    """What a schema cannot say: tables that belong together."""
    levels, tiles = manifest["levels"], manifest["tiles"]
    if [level["level"] for level in levels] != list(range(len(levels))):
        yield "levels must count up from 0"
    far = [level["distance"] for level in levels]
    if None in far[:-1] or far[-1] is not None or any(b <= a for a, b in zip(far[:-2], far[1:-1], strict=True)):
        yield "levels: distances must rise, and only the last is null"
    if any(b["mean_scale"] <= a["mean_scale"] for a, b in zip(levels, levels[1:], strict=False)):
        yield "levels: mean_scale must strictly rise"
    if [tile["tile"] for tile in tiles] != list(range(len(tiles))) or len(tiles) % 16:
        yield f"{len(tiles)} tiles: they must be 0 to 16 C - 1, in order"
    for tile in tiles:
        if [chunk["level"] for chunk in tile["chunks"]] != list(range(len(levels))):
            yield f"tile {tile['tile']}: one chunk a level is needed, in order"
        for chunk in tile["chunks"]:
            if chunk["bytes"] != chunk_size(chunk["count"], len(chunk["orders"])):
                yield f"{chunk['file']}: bytes do not fit count and orders"
            if max(chunk["orders"]) >= len(manifest["directions"]):
                yield f"{chunk['file']}: an order of a direction that is not there"


def read_manifest(folder: Path | str, schema: Path | str) -> dict:
    """Read and check a bundle's manifest.

    Raises: InputError: missing, too large, no JSON, of another format or version, or see `check`.
    """
    path = Path(folder) / NAME
    if path.is_file() and path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: {path.stat().st_size} bytes are no manifest; make the bundle again")
    manifest = read_json(path)
    known = isinstance(manifest, dict) and (manifest.get("format"), manifest.get("version"))
    if known != (FORMAT, VERSION):
        raise InputError(f"{path}: not a bundle of format {FORMAT!r}, version {VERSION}; make the bundle again")
    check_manifest(manifest, schema, path)
    return manifest
