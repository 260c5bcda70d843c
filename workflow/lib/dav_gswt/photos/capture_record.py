"""capture.json: the photos of a round, with the camera that was requested and the one that took each photo."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import parse_record, read_json, require_file_name, write_json
from dav_gswt.geometry.cameras import Camera, camera_from_json, camera_to_json
from dav_gswt.geometry.poses import Pose

if TYPE_CHECKING:
    from dav_gswt.photos.colmap_model import ColmapModel  # loads pycolmap


@dataclass(frozen=True)
class CapturedPhoto:
    """A photo of a capture folder.

    name: its file. pose, requested: what was asked for. camera: the one that took it. distance: between the two, see
    `view_distance`. taken: time (ISO 8601) if a device took it.
    """

    name: str
    pose: Pose
    requested: Camera
    camera: Camera
    distance: float
    taken: str | None = None


def write_capture_record(folder: Path, agent: str, photos: list[CapturedPhoto]) -> None:
    """Write capture.json."""
    rows = [
        {
            "name": photo.name,
            "asked": asdict(photo.pose) | {"camera": camera_to_json(photo.requested)},
            "got": camera_to_json(photo.camera),
            "asked_to_got": photo.distance,
            "taken": photo.taken,
        }
        for photo in photos
    ]
    write_json(folder / "capture.json", {"agent": agent, "shots": rows})


def read_capture_record(folder: Path | str) -> list[CapturedPhoto]:
    """Read capture.json. Raises: InputError: not such a record, or a photo's name leads out of the folder."""
    path = Path(folder) / "capture.json"
    try:
        return [_parse_photo(row) for row in read_json(path)["shots"]]
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: not the record of a capture ({summarize_error(error)}); make it again") from error


def _parse_photo(row: dict) -> CapturedPhoto:
    values = dict(row["asked"])
    requested, camera = camera_from_json(values.pop("camera")), camera_from_json(row["got"])
    pose, distance, taken = parse_record(values, Pose), row["asked_to_got"], row["taken"]
    if not isinstance(distance, int | float) or not isinstance(taken, str | None):
        raise TypeError("a distance or a time is none")
    return CapturedPhoto(require_file_name(row["name"]), pose, requested, camera, float(distance), taken)


@dataclass(frozen=True)
class TakenPhoto:
    """A photo that a round's field was made of, by the name under which it is exported.

    source: its undistorted file. camera: the pinhole that took it. round: when it was taken; 0 for
    start views.
    """

    name: str
    source: Path
    camera: Camera
    round: int


def list_taken_photos(
    images: Path | str, known: "ColmapModel", start: Sequence[str], captures: Sequence
) -> list[TakenPhoto]:
    """The start views, then the photos of every capture folder, in their order.

    If a name is in use already, the number of the capture folder is put in front.
    Raises: InputError: see `read_capture_record`, or a start view that the model does not have.
    """
    photos = [TakenPhoto(name, Path(images) / name, known.camera(name), 0) for name in start]
    names = set(start)
    for number, folder in enumerate(captures, 1):
        for shot in read_capture_record(folder):
            name = f"iter{number}_{shot.name}" if shot.name in names else shot.name
            names.add(name)
            photos.append(TakenPhoto(name, Path(folder) / shot.name, shot.camera, number))
    return photos
