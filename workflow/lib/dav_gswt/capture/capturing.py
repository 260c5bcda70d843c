"""The capture of a round: poses that an agent can attain, its photos, and capture.json."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dav_gswt.capture.agents import AGENTS
from dav_gswt.capture.store import PhotoStore
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import CapturedPhoto, read_capture_record, write_capture_record
from dav_gswt.photos.lenses import undistort_scene_photo
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views import candidates as pools
from dav_gswt.views import collision, feasibility
from dav_gswt.views.candidates import Candidates

RequestedPose = tuple[Pose, Camera]


@dataclass(frozen=True)
class Site:
    """A scene to photograph.

    name, scene: its name and entry in the config. photos: its photos/ folder. store: photos taken by devices and
    people. field: the reconstruction so far, a .ply. shot_list_template: of the page that `handheld` writes.
    requested: the cameras that this round and the earlier ones request; a dropped photo stored for one is in use.
    """

    name: str
    scene: dict
    frame: SceneFrame
    photos: Path
    store: PhotoStore
    field: Path | str | None = None
    shot_list_template: Path | str | None = None
    requested: tuple[Camera, ...] = ()

    @property
    def burst(self) -> int:
        """Photos per pose; each counts against the budget."""
        return self.scene.get("burst", 1)

    @property
    def unit(self) -> float:
        """The flying height in world units."""
        return self.frame.flying_height

    def missing_photos(self, camera: Camera) -> int:
        """Number of photos of a pose that the store lacks."""
        return self.burst - len(self.store.photos_of(camera))


@dataclass(frozen=True)
class CaptureRequest:
    """Poses to photograph.

    remaining: all candidates that are not used yet, the requested ones included. folder: where the photos go.
    """

    site: Site
    poses: list[RequestedPose]
    remaining: Candidates
    folder: Path


def view_distance(a: Camera, b: Camera, unit: float) -> float:
    """Distance of two views: between the centres in units of `unit` (the flying height), plus the angle between the
    viewing directions in radians."""
    angle = np.arccos(np.clip(a.forward @ b.forward, -1, 1))
    return float(np.linalg.norm(a.centre - b.centre) / unit + angle)


def photo_name(pose: Pose, i: int, burst: int) -> str:
    """File name of the i-th photo of a pose."""
    return f"{pose.name}.png" if burst == 1 else f"{pose.name}_{i}.png"


def filter_attainable(
    scene: dict, frame: SceneFrame, grid: Ground, field: GaussianField, candidates: Candidates
) -> Candidates:
    """Keep the poses that the scene's agent reaches, that are feasible over the ground and not inside an object.

    scene: its entry in the config. Photos that exist are all kept.
    Raises: InputError: no pose is left.
    """
    agent = AGENTS[scene["agent"]]
    if agent.pool:
        return candidates
    if agent.keep_reachable:
        candidates = agent.keep_reachable(scene, frame, candidates)
    clearance = feasibility.CLEARANCE * frame.flying_height
    feasible = feasibility.filter_feasible(candidates, grid, scene.get("feasibility"), clearance)
    return collision.drop_blocked(feasible, field, grid)


def capture_views(site: Site, split: ViewSplit, before: list, chosen: list[Pose], folder: Path) -> None:
    """Fill `folder` with the photos of the chosen poses and with capture.json.

    split: views.json. before: the capture folders of earlier rounds. chosen: the poses to photograph; if there is none
    the agent is not called.
    """
    remaining = pools.list_remaining(site.scene, site.frame, site.photos / "sparse", split, before)
    requested = pools.select_by_name(remaining, chosen)
    earlier = [photo.requested for capture in before for photo in read_capture_record(capture)]
    site = replace(site, requested=(*earlier, *(camera for _, camera in requested)))
    folder.mkdir(parents=True, exist_ok=True)
    photos = take_requested(CaptureRequest(site, requested, remaining, folder)) if requested else []
    write_capture_record(folder, site.scene["agent"], photos)


def take_requested(request: CaptureRequest) -> list[CapturedPhoto]:
    """Have the scene's agent take photos. A device takes those that the store lacks; all are then undistorted."""
    site, agent = request.site, AGENTS[request.site.scene["agent"]]
    if not agent.device:
        return agent.take(request)
    with site.store.locked():
        missing = [(pose, camera) for pose, camera in request.poses if site.missing_photos(camera) > 0]
        if missing:
            agent.take(site, missing)
        return [photo for requested in request.poses for photo in _undistort_stored(request, requested)]


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
