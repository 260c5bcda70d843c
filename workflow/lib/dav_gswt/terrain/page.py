"""A page folder: the viewer, the manifest and its chunks, ready to be served or put on any web server."""

import hashlib
import os
import shutil
from pathlib import Path, PurePosixPath

from dav_gswt.bundle.manifest import FORMAT, VERSION
from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.errors import InputError
from dav_gswt.files import read_json, whole_folder, write_json
from dav_gswt.terrain.heights import Flat, Heights, Hills, Relief

SURFACE = "heights.bin"
MOST_PIXELS = 4096  # of a height map's side: graphics cards that take no larger texture are still in use


def write_page(
    bundle_dir: Path | str, viewer_dir: Path | str, out_dir: Path | str, surface: Heights | None = None
) -> None:
    """Copy viewer, manifest and chunks to `out_dir`, which appears whole or not at all.

    An older page at `out_dir` stays until the new one is complete. Only the chunks that the manifest names are copied.
    surface: what the tiles are laid over (default: level ground), written into the page's manifest as `heights`; the
    pixels of a height map are heights.bin, float32, little-endian, rows from the north.

    Raises: InputError: the manifest is missing or of another version, a chunk is missing, has another size than the
        manifest says, or lies outside of the bundle; the viewer is incomplete; a height map is too large (`described`).
    """
    bundle, viewer, out = Path(bundle_dir), Path(viewer_dir), Path(out_dir)
    if not (viewer / "index.html").is_file():
        raise InputError(f"{viewer}: no viewer here (index.html is missing)")
    copies = [(path, path.name) for path in sorted(viewer.iterdir()) if path.is_file()]
    copies += [(bundle / name, name) for name in chunk_names(bundle)]
    heights, pixels = described(surface or Flat())
    with whole_folder(out) as part:
        for source, name in copies:
            _copy(source, part / name)
        if pixels:
            (part / SURFACE).write_bytes(pixels)
        write_json(part / MANIFEST, read_json(bundle / MANIFEST) | {"heights": heights})


def described(surface: Heights) -> tuple[dict, bytes]:
    """A surface as the page's manifest has it, and the bytes of its pixels (none where it has none).

    Raises: InputError: more than MOST_PIXELS along a side.
    """
    if isinstance(surface, Hills):
        names = ("height", "wavelength", "octaves", "salt")
        return {"kind": "hills"} | {name: getattr(surface, name) for name in names}, b""
    if not isinstance(surface, Relief):
        return {"kind": "flat"}, b""
    rows, columns = surface.pixels.shape
    if max(rows, columns) > MOST_PIXELS:
        raise InputError(f"heights: {columns} x {rows} pixels; the page takes {MOST_PIXELS} a side: shrink the image")
    data = surface.pixels.astype("<f4").tobytes()
    entry = {"kind": "image", "file": SURFACE, "rows": rows, "columns": columns}
    entry |= {"width": surface.width, "beyond": surface.beyond, "bytes": len(data)}
    return entry | {"sha256": hashlib.sha256(data).hexdigest()}, data


def chunk_names(bundle: Path) -> list[str]:
    """The chunk files that a bundle's manifest names, checked against the folder. Raises: InputError, as write_page."""
    manifest = read_json(bundle / MANIFEST)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT or manifest.get("version") != VERSION:
        raise InputError(f"{bundle / MANIFEST}: not a bundle of format {FORMAT!r}, version {VERSION}; make it again")
    try:
        chunks = [(chunk["file"], chunk["bytes"]) for tile in manifest["tiles"] for chunk in tile["chunks"]]
    except (KeyError, TypeError) as error:
        raise InputError(f"{bundle / MANIFEST}: incomplete tile table ({error}); make the bundle again") from error
    for name, size in chunks:
        if not _inside(name):
            raise InputError(f"{bundle / MANIFEST}: chunk {name!r} lies outside of the bundle")
        path = bundle / name
        if not path.is_file():
            raise InputError(f"{path}: this chunk is missing; make the bundle again")
        if path.stat().st_size != size:
            raise InputError(f"{path}: {path.stat().st_size} bytes instead of {size}; make the bundle again")
    return list(dict.fromkeys(name for name, _ in chunks))


def _inside(name) -> bool:
    """A plain relative path that cannot leave the folder it starts from."""
    return isinstance(name, str) and "\\" not in name and not {"..", "/", ""} & set(PurePosixPath(name).parts or ("",))


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    with target.open("rb") as file:
        os.fsync(file.fileno())
