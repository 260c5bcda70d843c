"""The agent `plan`: writes a mission for a drone, whose photos come through the drop folder."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.capture import drop_folder, missing_photos, qgc_plan
from dav_gswt.capture.interface import RequestedPose
from dav_gswt.capture.site import Site
from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.views.candidates import Candidates


def filter_reachable(scene: dict, frame: SceneFrame, candidates: Candidates) -> Candidates:
    """Keep the poses that are not too low to fly to; all where the scene's unit in metres is not known.

    Raises: InputError: no pose is left.
    """
    if frame.georeference is None or not candidates:
        return candidates
    least = scene.get("drone", {}).get("min_altitude", qgc_plan.FlightRules.min_altitude)
    scale = frame.georeference.metres_per_unit
    found = [(pose, camera) for pose, camera in candidates if scale * camera.centre[2] >= least]
    if not found:
        raise InputError(
            f"all {len(candidates)} candidate poses are lower than {least:g} m (drone.min_altitude of the scene's "
            "entry), too low for a drone; give `poses` larger radii or another height, or take agent: handheld"
        )
    return found


def take_photos(site: Site, requested: list[RequestedPose]) -> None:
    """Import dropped photos; for those still missing write a mission.

    Raises: InputError: photos are missing (the message says which, and what to fly), the scene has no georeference,
        its ground is too steep, or a pose is too low to fly to.
    """
    missing = drop_folder.import_dropped_photos(site, requested, "plan")
    if not missing:
        return
    place = site.frame.georeference
    if place is None:
        raise InputError(
            f"scenes.{site.name}: a mission needs to know where on earth the scene lies (georeference in ground.json), "
            "which is known where the photos carry GPS positions in their EXIF; use photos that do, or agent: handheld"
        )
    exemplar = site.frame.exemplar
    home = np.array([exemplar.west + exemplar.side / 2, exemplar.south])
    rules = qgc_plan.FlightRules(**{key: float(value) for key, value in site.scene.get("drone", {}).items()})
    _check_level(site, place, missing, home, rules)
    flown = qgc_plan.plan_flight([(pose.name, camera) for pose, camera in missing], place, home, rules, site.burst)
    path = site.store.folder / "mission.plan"
    write_json(path, flown.content)
    raise InputError(
        f"{path}: fly this mission (QGroundControl: Plan, Open): {missing_photos.describe_missing(site, missing)}. "
        f"It is a flight of {flown.describe()}; take off from the ground near {flown.describe_home()}. "
        f"Then {missing_photos.describe_delivery(site)}"
    )


def _check_level(
    site: Site, place: Georeference, missing: list[RequestedPose], home: Float[Array, "2"], rules: qgc_plan.FlightRules
) -> None:
    """Check that the ground is level enough, as a mission assumes: `altitude` is wrong by distance times slope.

    Raises: InputError: a pose is off by more than half its altitude, or by more than half the clearance.
    """
    at = place.metres_per_unit * np.stack([camera.centre for _, camera in missing])
    off = np.linalg.norm(at[:, :2] - place.metres_per_unit * home, axis=1) * np.tan(np.radians(place.slope))
    low, worst, drone = off > at[:, 2] / 2, float(off.max()), f"scenes.{site.name}.drone"
    enough = f"{np.ceil(2 * worst):.0f} or more"
    remedies = [f"{drone}.clearance to {enough}"] if worst > rules.clearance / 2 else []
    if low.any():
        remedies.append(f"{drone}.min_altitude to {enough}")
    if not remedies:
        return
    names = ", ".join(pose.name for (pose, _), short in zip(missing, low, strict=True) if short)
    raise InputError(
        f"scenes.{site.name}: the ground slopes by {place.slope:.1f} degrees, so that altitudes of a mission over "
        f"level ground would be wrong by up to {worst:.1f} m"
        + (f", and of {names} by more than half" if names else "")
        + f"; set {' and '.join(remedies)} if there is room to spare everywhere, or take agent: handheld"
    )
