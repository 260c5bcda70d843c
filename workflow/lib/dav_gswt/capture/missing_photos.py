"""Messages that tell people which photos are missing and where to put them."""

from dav_gswt.capture import drop_folder
from dav_gswt.capture.interface import RequestedPose
from dav_gswt.capture.site import Site

NAMED = 6  # poses that a message names


def describe_missing(site: Site, missing: list[RequestedPose]) -> str:
    """Say how many photos of which poses are missing."""
    photos = sum(site.missing_photos(camera) for _, camera in missing)
    names = ", ".join(pose.name for pose, _ in missing[:NAMED]) + (", ..." if len(missing) > NAMED else "")
    count = "1 photo is" if photos == 1 else f"{photos} photos are"
    return f"{count} missing, of {len(missing)} {'pose' if len(missing) == 1 else 'poses'} ({names})"


def describe_delivery(site: Site) -> str:
    """Say what to do with the photos."""
    folder = drop_folder.make_drop_folder(site)
    return f"put the photos into {folder} and run the same command again: photos that are already there are kept"
