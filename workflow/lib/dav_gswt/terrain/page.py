"""A page folder: the viewer, the manifest and its chunks, ready to be served or put on any web server."""

import os
import shutil
from pathlib import Path, PurePosixPath

from dav_gswt.bundle.manifest import FORMAT, VERSION
from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.errors import InputError
from dav_gswt.files import read_json, whole_folder


def write_page(bundle_dir: Path | str, viewer_dir: Path | str, out_dir: Path | str) -> None:
    """Copy viewer, manifest and chunks to `out_dir`, which appears whole or not at all.

    An older page at `out_dir` stays until the new one is complete. Only the chunks that the manifest names are copied.

    Raises: InputError: the manifest is missing or of another version, a chunk is missing, has another size than the
        manifest says, or lies outside of the bundle; the viewer is incomplete.
    """
    bundle, viewer, out = Path(bundle_dir), Path(viewer_dir), Path(out_dir)
    if not (viewer / "index.html").is_file():
        raise InputError(f"{viewer}: no viewer here (index.html is missing)")
    copies = [(bundle / MANIFEST, MANIFEST)]
    copies += [(path, path.name) for path in sorted(viewer.iterdir()) if path.is_file()]
    copies += [(bundle / name, name) for name in chunk_names(bundle)]
    with whole_folder(out) as part:
        for source, name in copies:
            _copy(source, part / name)


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
