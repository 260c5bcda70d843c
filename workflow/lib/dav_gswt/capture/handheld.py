"""The agent `handheld`: writes a shot list for a person, whose photos come through the drop folder."""

from pathlib import Path

import numpy as np

from dav_gswt.capture import directions, drop_folder, missing_photos, route, shot_list_page
from dav_gswt.capture.interface import RequestedPose
from dav_gswt.capture.site import Site
from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import atomic_folder


def take_photos(site: Site, requested: list[RequestedPose], field: Path | str | None = None) -> None:
    """Import dropped photos; for those still missing write a shot list.

    field: the current field, for the map and the expected pictures; by default the one of the site, if any.
    Raises: InputError: photos are missing (the message says which, and names the page to follow).
    """
    missing = drop_folder.import_dropped_photos(site, requested, "handheld")
    if not missing:
        return
    listed = write_shot_list(site, missing, field or site.field)
    raise InputError(
        f"{listed}: take this page with you, printed or its folder copied to a phone: "
        f"{missing_photos.describe_missing(site, missing)}. Then {missing_photos.describe_delivery(site)}"
    )


def write_shot_list(site: Site, missing: list[RequestedPose], field: Path | str | None) -> Path:
    """Write captures/{scene}/shot-list/ with the poses in a short walking order. Returns its page."""
    if site.shot_list_template is None:
        raise ValueError("the agent handheld needs the template of its page")
    ground = np.array([camera.centre[:2] for _, camera in missing])
    ordered = route.order_stops(ground)
    stations = [
        shot_list_page.Station(pose.name, camera, site.missing_photos(camera))
        for pose, camera in (missing[i] for i in ordered)
    ]
    length = route.path_length(ground[list(ordered)])
    shot_list = shot_list_page.ShotList(
        site.name, site.frame, directions.make_ruler(site.frame), drop_folder.make_drop_folder(site), length
    )
    folder = site.store.folder / "shot-list"
    with atomic_folder(folder) as part:
        shot_list_page.write_page(
            part, site.shot_list_template, shot_list, stations, read_field(field) if field else None
        )
    return folder / "index.html"
