"""How people are told which photos are missing and where to put them."""

from dav_gswt.capture import drop_folder
from dav_gswt.capture.shots import Asked
from dav_gswt.capture.site import Site

NAMED = 6  # poses that a message names


def photos_missing(site: Site, missing: list[Asked]) -> int:
    """How many photos the poses still lack."""
    return sum(site.burst - len(site.store.of(camera)) for _, camera in missing)


def lacking(site: Site, missing: list[Asked]) -> str:
    """How many photos of which poses are not there yet."""
    photos = photos_missing(site, missing)
    names = ", ".join(pose.name for pose, _ in missing[:NAMED]) + (", ..." if len(missing) > NAMED else "")
    many = "1 photo is" if photos == 1 else f"{photos} photos are"
    return f"{many} missing, of {len(missing)} {'pose' if len(missing) == 1 else 'poses'} ({names})"


def bring(site: Site) -> str:
    """What to do with the photos."""
    return f"put the photos into {drop_folder.folder_of(site)} and run the same command again: what is there is kept"
