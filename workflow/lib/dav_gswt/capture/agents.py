"""The capture agents by name, and the capture of a round.

To add an agent, write a `CaptureAgent` and name it in `AGENTS`. Agents of devices and people only fill the photo store:
wrap such a function in `StoreAgent`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from dav_gswt.capture import drone, handheld, render, replay, serial_rig
from dav_gswt.capture.interface import CaptureAgent, CaptureRequest, RequestedPose, photo_name, view_distance
from dav_gswt.capture.site import Site
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import CapturedPhoto, read_capture_record, write_capture_record
from dav_gswt.photos.lenses import undistort_scene_photo
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.views import candidates


@dataclass(frozen=True)
class StoreAgent:
    """Agent that takes the photos which the store lacks, then undistorts all requested ones into the capture folder.

    take_photos: fills the store; raises InputError as long as photos are missing.
    """

    take_photos: Callable[[Site, list[RequestedPose]], None]

    def __call__(self, request: CaptureRequest) -> list[CapturedPhoto]:
        site = request.site
        with site.store.locked():
            missing = [(pose, camera) for pose, camera in request.poses if site.missing_photos(camera) > 0]
            if missing:
                self.take_photos(site, missing)
            return [photo for requested in request.poses for photo in _undistort_stored(request, requested)]


AGENTS: dict[str, CaptureAgent] = {
    "render": render.capture_rendered,
    "replay": replay.capture_replayed,
    "serial": StoreAgent(serial_rig.take_photos),
    "plan": StoreAgent(drone.take_photos),
    "handheld": StoreAgent(handheld.take_photos),
}


def capture_views(site: Site, split: ViewSplit, before: list, chosen: list[Pose], folder: Path) -> None:
    """Fill `folder` with the photos of the chosen poses and with capture.json.

    split: views.json. before: the capture folders of earlier rounds. chosen: the poses to photograph. The agent is not
    called if no pose was chosen.
    """
    remaining = candidates.list_remaining(site.scene, site.frame, site.photos / "sparse", split, before)
    requested = candidates.select_by_name(remaining, chosen)
    earlier = [photo.requested for capture in before for photo in read_capture_record(capture)]
    site = replace(site, requested=(*earlier, *(camera for _, camera in requested)))
    folder.mkdir(parents=True, exist_ok=True)
    agent = site.scene["agent"]
    photos = AGENTS[agent](CaptureRequest(site, requested, remaining, folder)) if requested else []
    write_capture_record(folder, agent, photos)


def _undistort_stored(request: CaptureRequest, requested: RequestedPose) -> list[CapturedPhoto]:
    """Write a pose's stored photos as its pinhole camera would have taken them."""
    site, (pose, camera) = request.site, requested
    photos = []
    for i, stored in enumerate(site.store.photos_of(camera)[: site.burst]):
        name = photo_name(pose, i, site.burst)
        picture = undistort_scene_photo(image_files.read_photo(stored.photo), site.photos, stored.camera)
        image_files.write_png(request.folder / name, picture)
        distance = view_distance(camera, stored.camera, site.unit)
        photos.append(CapturedPhoto(name, pose, camera, stored.camera, distance, stored.taken))
    return photos
