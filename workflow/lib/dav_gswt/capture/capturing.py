"""The capture of a round: poses that an agent can attain, its photos, and capture.json."""

from dataclasses import replace
from pathlib import Path

from dav_gswt.capture import drone, serial_rig
from dav_gswt.capture.agents import AGENTS
from dav_gswt.capture.store import RequestedPose, Site, view_distance
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
from dav_gswt.views.candidates import Candidates

# Of agents that cannot take photos everywhere: called with a scene's entry, its frame and candidates.
REACHABLE = {"serial": serial_rig.filter_reachable, "plan": drone.filter_reachable}


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
    if keep_reachable := REACHABLE.get(scene["agent"]):
        candidates = keep_reachable(scene, frame, candidates)
    return pools.filter_feasible(candidates, field, grid, frame.flying_height)


def capture_views(site: Site, split: ViewSplit, before: list, chosen: list[Pose], folder: Path) -> None:
    """Fill `folder` with the photos of the chosen poses and with capture.json.

    split: views.json. before: the capture folders of earlier rounds. chosen: the poses to photograph; if there is none
    the agent is not called.
    """
    remaining = pools.list_remaining(site.scene, site.frame, site.photos / "sparse", split, before)
    by_name = {pose.name: (pose, camera) for pose, camera in remaining}
    requested = [by_name[pose.name] for pose in chosen]
    earlier = [photo.requested for capture in before for photo in read_capture_record(capture)]
    site = replace(site, requested=(*earlier, *(camera for _, camera in requested)))
    folder.mkdir(parents=True, exist_ok=True)
    photos = take_requested(site, requested, remaining, folder) if requested else []
    write_capture_record(folder, site.scene["agent"], photos)


def take_requested(site: Site, poses: list[RequestedPose], remaining: Candidates, folder: Path) -> list[CapturedPhoto]:
    """Have the scene's agent take photos. A device takes those that the store lacks; all are then undistorted.

    remaining: all candidates that are not used yet, the requested ones included.
    """
    agent = AGENTS[site.scene["agent"]]
    if not agent.device:
        return agent.take(site, poses, remaining, folder)
    with site.store.locked():
        missing = [(pose, camera) for pose, camera in poses if not site.store.photos_of(camera)]
        if missing:
            agent.take(site, missing)
        return [_undistort_stored(site, pose, camera, folder) for pose, camera in poses]


def _undistort_stored(site: Site, pose: Pose, camera: Camera, folder: Path) -> CapturedPhoto:
    """Write a pose's oldest stored photo as its pinhole camera would have taken it."""
    stored, name = site.store.photos_of(camera)[0], f"{pose.name}.png"
    picture = undistort_scene_photo(image_files.read_photo(stored.photo), site.photos, stored.camera)
    image_files.write_png(folder / name, picture)
    distance = view_distance(camera, stored.camera, site.frame)
    return CapturedPhoto(name, pose, camera, stored.camera, distance, stored.taken)
