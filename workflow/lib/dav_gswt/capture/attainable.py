"""The candidate poses at which the agent of a scene can take a photo."""

from dav_gswt.capture import drone, serial_rig
from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views import feasibility
from dav_gswt.views.candidates import Candidates


def filter_attainable(
    scene: dict, frame: SceneFrame, grid: Ground, field: GaussianField, candidates: Candidates
) -> Candidates:
    """Keep the poses that a rig or a drone reaches, that are feasible over the ground and not inside an object.

    scene: its entry in the config. A replayed scene keeps all: its photos were taken, wherever they stand.
    Raises: InputError: no pose is left.
    """
    if scene["agent"] == "replay":
        return candidates
    if scene["agent"] == "serial":
        candidates = serial_rig.filter_reachable(scene, frame, candidates)
    elif scene["agent"] == "plan":
        candidates = drone.filter_reachable(scene, frame, candidates)
    clearance = feasibility.CLEARANCE * frame.flying_height
    feasible = feasibility.filter_feasible(candidates, grid, scene.get("feasibility"), clearance)
    return feasibility.drop_blocked(feasible, field, grid)
