"""The agent of a photo set: takes the nearest unused photo for each requested pose."""

import shutil

from dav_gswt.capture.interface import CaptureRequest, view_distance
from dav_gswt.photos.capture_record import CapturedPhoto


def capture_replayed(request: CaptureRequest) -> list[CapturedPhoto]:
    """Copy the `burst` photos nearest to each pose by `view_distance`, ties by name; fewer where the pool ends."""
    site, remaining = request.site, {pose.name: camera for pose, camera in request.remaining}
    photos = []
    for pose, camera in request.poses:
        for _ in range(min(site.burst, len(remaining))):
            distance = {name: view_distance(camera, other, site.unit) for name, other in remaining.items()}
            name = min(distance, key=lambda n: (distance[n], n))
            shutil.copyfile(site.photos / "images" / name, request.folder / name)
            photos.append(CapturedPhoto(name, pose, camera, remaining.pop(name), distance[name]))
    return photos
