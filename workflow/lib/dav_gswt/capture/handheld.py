"""The agent handheld: a person walks along a shot list, the photos are dropped into a folder."""

from pathlib import Path

import numpy as np

from dav_gswt.capture import directions, drop_folder, requests, route, shot_list_page
from dav_gswt.capture.shots import Asked
from dav_gswt.capture.site import Site
from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.files import whole_folder


def take(site: Site, asked: list[Asked], field: Path | str | None = None) -> None:
    """Take over what was dropped; for what is still missing write a shot list, and say what to do with it.

    field: the field as it is now, for the map and the pictures expected; by default the site's, if it has one.
    Raises: InputError: photos are missing (which, and which page to follow).
    """
    missing = drop_folder.collect(site, asked, "handheld")
    if not missing:
        return
    listed = shot_list(site, missing, field or site.field)
    raise InputError(
        f"{listed}: take this page with you, printed or its folder copied to a phone: "
        f"{requests.lacking(site, missing)}. Then {requests.bring(site)}"
    )


def shot_list(site: Site, missing: list[Asked], field: Path | str | None) -> Path:
    """Write captures/{scene}/shot-list/ for poses in an order that is short to walk; returns its page."""
    ground = np.array([camera.centre[:2] for _, camera in missing])
    ordered = route.order(ground)
    stations = [
        shot_list_page.Station(pose.name, camera, site.burst - len(site.store.of(camera)))
        for pose, camera in (missing[i] for i in ordered)
    ]
    length = route.length(ground[list(ordered)])
    errand = shot_list_page.Errand(
        site.name, site.frame, directions.ruler(site.frame), drop_folder.folder_of(site), length
    )
    folder = site.store.folder / "shot-list"
    with whole_folder(folder) as part:
        shot_list_page.write(part, errand, stations, read_field(field) if field else None)
    return folder / "index.html"
