"""Photos that people or drones bring: dropped into a folder, found a place in the model, given to the poses asked for.

A dropped photo stays where it is; what is taken over is copied into the store. One that finds no place, or that no
asked pose is near to, is named with its reason and waits.
"""

import logging
from datetime import UTC, datetime
from pathlib import Path

from dav_gswt.capture.shots import Asked, apart
from dav_gswt.capture.site import Site
from dav_gswt.files import digest
from dav_gswt.images import image_files
from dav_gswt.photos import exif
from dav_gswt.photos.sfm import localization

_log = logging.getLogger(__name__)

NEAR = 0.6  # `shots.apart` of a photo from the pose that it is taken for: farther, it shows something else


def folder_of(site: Site) -> Path:
    """Where photos are to be dropped; made if it is not there."""
    folder = site.store.folder / "drop"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def collect(site: Site, asked: list[Asked], agent: str) -> list[Asked]:
    """Take over what was dropped, nearest photos first; returns the poses that still lack photos."""
    known = {record["sha256"] for record in site.store.records()}
    folder = folder_of(site)
    here = image_files.list_photos(folder) if any(not p.name.startswith(".") for p in folder.iterdir()) else []
    paths = [p for p in here if digest(p) not in known]  # cameras use names again
    found = [(p, camera) for p, camera in zip(paths, localization.located(site.photos, paths), strict=True) if camera]
    for path in sorted(set(paths) - {p for p, _ in found}):
        _log.warning("%s: its place in the scene was not found; it must overlap photos that are there", path.name)
    need = {pose.name: site.burst - len(site.store.of(camera)) for pose, camera in asked}
    pairs = [(apart(camera, got, site.unit), pose.name, path) for path, got in found for pose, camera in asked]
    places, given = dict(found), {}
    for far, name, path in sorted(pairs, key=lambda p: (p[0], p[1], p[2].name)):
        if path not in given and need[name] > 0 and far <= NEAR:
            given[path] = name
            need[name] -= 1
    for pose, camera in asked:
        for path in sorted(p for p, name in given.items() if name == pose.name):
            site.store.add(path, agent, pose, camera, places[path], _taken(path))
    for path in sorted(set(places) - set(given)):
        _log.warning("%s: no pose that is asked for is near its place; it is not used", path.name)
    return [(pose, camera) for pose, camera in asked if need[pose.name] > 0]


def _taken(path: Path) -> str:
    return exif.taken(path) or datetime.fromtimestamp(path.stat().st_mtime, UTC).isoformat(timespec="seconds")
