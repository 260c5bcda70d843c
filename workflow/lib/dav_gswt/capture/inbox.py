"""The folder into which a tethered camera's software saves photos: which one is new, and is it whole?"""

import time
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.images import image_files

POLL = 0.25  # seconds between looks; a photo that did not change from one to the next may be whole

Listing = dict[str, tuple[int, int]]


def listing(folder: Path) -> Listing:
    """The photos that lie in a folder: size and time of change by name, so that one written over counts as new.

    Raises: InputError: no such folder.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; rig.inbox is where the camera's software saves photos")
    found = {}
    for path in folder.iterdir():
        if path.suffix.lower() in image_files.SUFFIXES and not path.name.startswith("."):
            try:
                stat = path.stat()
            except FileNotFoundError:  # renamed meanwhile: its new name comes with the next look
                continue
            found[path.name] = (stat.st_size, stat.st_mtime_ns)
    return found


def new(folder: Path, before: Listing) -> Listing:
    """What came since `before`."""
    return {name: stat for name, stat in listing(folder).items() if before.get(name) != stat}


def arrived(folder: Path, before: Listing, patience: float) -> Path | None:
    """The one photo that came since `before`, once it is whole; None where none came within `patience` seconds.

    Raises: InputError: more than one came, or one that is not whole when the time is up.
    """
    until, last, trouble, judged = time.monotonic() + patience, {}, "", {}
    while True:
        now = new(folder, before)
        if now == last and len(now) > 1:
            raise InputError(
                f"{folder}: {len(now)} photos came for one exposure ({', '.join(sorted(now)[:5])}); set the camera to "
                "single photos of one format, remove them, and run the same again"
            )
        if now and now == last and now != judged:
            path, judged = folder / next(iter(now)), now
            if not (trouble := _trouble(path)):
                return path
        if time.monotonic() > until:
            break
        last = now
        time.sleep(POLL)
    if now:
        name = next(iter(now))
        raise InputError(f"{trouble or folder / name} (waited {patience:g} s for it; rig.photo_timeout is how long)")
    return None


def _trouble(path: Path) -> str:
    try:
        image_files.read_photo(path)
    except InputError as error:
        return str(error)
    return ""
