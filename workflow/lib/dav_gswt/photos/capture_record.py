"""capture.json: the photos of a round, with the camera that was requested and the one that took each photo."""

from dataclasses import asdict, dataclass
from pathlib import Path

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import parse_record, read_json, require_file_name, write_json
from dav_gswt.geometry.cameras import Camera, camera_from_json, camera_to_json
from dav_gswt.geometry.poses import Pose


@dataclass(frozen=True)
class CapturedPhoto:
    """A photo of a capture folder.

    name: its file. pose, requested: what was asked for. camera: the one that took it. distance: between the two, see
    `view_distance`. taken: time (ISO 8601), where a device took it.
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
    requested = camera_from_json(values.pop("camera"))
    camera = camera_from_json(row["got"])
    pose, distance, taken = parse_record(values, Pose), row["asked_to_got"], row["taken"]
    if not isinstance(distance, int | float) or not isinstance(taken, str | None):
        raise TypeError("a distance or a time is none")
    return CapturedPhoto(require_file_name(row["name"]), pose, requested, camera, float(distance), taken)
