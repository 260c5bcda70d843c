"""The agent of synthetic scenes: renders each photo exactly at its requested pose."""

from dav_gswt.capture.interface import CaptureRequest, photo_name
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
