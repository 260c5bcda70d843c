"""The drop folder: photos by people and drones are localised in the model and assigned to the requested poses.

Assigned photos are copied into the store; the dropped files stay. A photo that cannot be localised, or is near to no
requested pose, is logged with the reason.
"""

import logging
from datetime import UTC, datetime
from pathlib import Path

from dav_gswt.capture.store import RequestedPose, Site, view_distance
from dav_gswt.files import digest_files
from dav_gswt.photos.photo_files import read_capture_time
from dav_gswt.photos.photo_listing import list_photos
from dav_gswt.photos.sfm.localization import localize_photos

_log = logging.getLogger(__name__)

NEAR = 0.6  # greatest `view_distance` of a photo from its pose: beyond, it shows something else
NAMED = 6  # poses that a message names


def make_drop_folder(site: Site) -> Path:
    """Return the drop folder; create it if it does not exist."""
    folder = site.store.folder / "drop"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def import_dropped_photos(site: Site, requested: list[RequestedPose], agent: str) -> list[RequestedPose]:
    """Copy dropped photos into the store, nearest first. Returns the poses that still lack photos.

    A photo that is stored for a pose of this round or of an earlier one (`Site.requested`) is in use and skipped. A
    photo stored for a pose that is no longer requested is localised again. Of equal files the first counts.
    """
    paths = _list_new_photos(site, requested)
    found = [(p, camera) for p, camera in zip(paths, localize_photos(site.photos, paths), strict=True) if camera]
    for path in sorted(set(paths) - {p for p, _ in found}):
        _log.warning("%s: it could not be localised; it must overlap photos of the scene", path.name)
    open_poses = [(pose, camera) for pose, camera in requested if not site.store.photos_of(camera)]
    pairs = [
        (view_distance(camera, got, site.frame), pose.name, path.name, path)
        for path, got in found
        for pose, camera in open_poses
    ]
    places, assigned = dict(found), {}
    for distance, name, _, path in sorted(pairs):
        if distance <= NEAR and name not in assigned and path not in assigned.values():
            assigned[name] = path
    for pose, camera in open_poses:
        if path := assigned.get(pose.name):
            modified = datetime.fromtimestamp(path.stat().st_mtime, UTC).isoformat(timespec="seconds")
            site.store.add(path, agent, (pose, camera), places[path], read_capture_time(path) or modified)
    for path in sorted(set(places) - set(assigned.values())):
        _log.warning("%s: it is near no requested pose; it is not used", path.name)
    return [(pose, camera) for pose, camera in open_poses if pose.name not in assigned]


def _list_new_photos(site: Site, requested: list[RequestedPose]) -> list[Path]:
    """The dropped photos that no pose of the run has yet, each once: by content, as cameras use names again."""
    folder = make_drop_folder(site)
    here = list(list_photos(folder).photos.values())
    used, new = site.store.list_digests([*site.requested, *(camera for _, camera in requested)]), {}
    for path in here:
        digest = digest_files(path)
        if digest in new:
            _log.warning("%s: the same photo as %s; it counts once", path.name, new[digest].name)
        elif digest not in used:
            new[digest] = path
    return list(new.values())


def describe_missing(site: Site, missing: list[RequestedPose]) -> str:
    """Say of which poses photos are missing, and what to do with the photos."""
    names = ", ".join(pose.name for pose, _ in missing[:NAMED]) + (", ..." if len(missing) > NAMED else "")
    return (
        f"photos of {len(missing)} pose{'' if len(missing) == 1 else 's'} are missing ({names}). Put the photos into "
        f"{make_drop_folder(site)} and run the same command again: photos that are already there are kept"
    )
