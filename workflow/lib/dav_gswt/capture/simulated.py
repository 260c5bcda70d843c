"""The agents without a device: `render` renders photos, `replay` takes them from a pool."""

import shutil

from dav_gswt.capture.capturing import CaptureRequest, photo_name, view_distance
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.capture_record import CapturedPhoto
from dav_gswt.photos.synthetic import scene as synthetic


def capture_rendered(request: CaptureRequest) -> list[CapturedPhoto]:
    """Render `burst` photos of each pose; photos of a burst differ in their noise."""
    world, burst = synthetic.scene_from_config(request.site.scene), request.site.burst
    photos = []
    for pose, camera in progress(request.poses, "render photos"):
        for i in range(burst):
            name = photo_name(pose, i, burst)
            image_files.write_png(request.folder / name, synthetic.render(world, camera, again=i))
            photos.append(CapturedPhoto(name, pose, camera, camera, 0.0))
    return photos


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
