"""The folder into which a tethered camera's software saves photos: detection of new, complete photos."""

import time
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.images import image_files

POLL = 0.25  # seconds between looks; a photo that did not change in between may be complete

Listing = dict[str, tuple[int, int]]


def list_photos(folder: Path) -> Listing:
    """List the photos of a folder: size and modification time by name, so that an overwritten one counts as new.

    Raises: InputError: no such folder.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; rig.inbox is where the camera's software saves photos")
    found = {}
    for path in folder.iterdir():
        if path.suffix.lower() in image_files.SUFFIXES and not path.name.startswith("."):
            try:
                stat = path.stat()
            except FileNotFoundError:  # renamed meanwhile
                continue
            found[path.name] = (stat.st_size, stat.st_mtime_ns)
    return found


def list_new_photos(folder: Path, before: Listing) -> Listing:
    """List photos that are new or changed since `before`."""
    return {name: stat for name, stat in list_photos(folder).items() if before.get(name) != stat}


def wait_for_photo(folder: Path, before: Listing, patience: float) -> Path | None:
    """Wait for the one photo that is new since `before`, until it is complete.

    Returns: None if no photo came within `patience` seconds.

    Raises: InputError: more than one came, or one that is incomplete when the time is up.
    """
    until = time.monotonic() + patience
    last: Listing = {}
    checked: Listing = {}
    error = ""
    while True:
        now = list_new_photos(folder, before)
        if now == last and len(now) > 1:
            raise InputError(
                f"{folder}: {len(now)} photos came for one exposure ({', '.join(sorted(now)[:5])}); set the camera to "
                "single photos of one format, remove them, and run the same again"
            )
        if now and now == last and now != checked:
            path, checked = folder / next(iter(now)), now
            if not (error := _read_error(path)):
                return path
        if time.monotonic() > until:
            break
        last = now
        time.sleep(POLL)
    if now:
        name = next(iter(now))
        raise InputError(f"{error or folder / name} (waited {patience:g} s for it; rig.photo_timeout is how long)")
    return None


def _read_error(path: Path) -> str:
    try:
        image_files.read_photo(path)
    except InputError as error:
        return str(error)
    return ""
