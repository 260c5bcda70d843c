"""The photo store: photos by devices and people, kept outside of all rule outputs, by pose, never changed.

captures/{scene}/{key}/{n}/ holds a photo as delivered and shot.json. If a round requests the same pose again, because
an earlier stage was computed anew or a run was killed, the stored photos are used.
"""

import fcntl
import hashlib
import shutil
import tempfile
from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import digest_files, read_json, require_file_name, write_json
from dav_gswt.geometry.cameras import Camera, camera_from_json, camera_to_json
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import SceneFrame

PLACES = 6  # decimals of a camera's numbers in its key: finer than any device repeats a pose


@dataclass(frozen=True)
class StoredPhoto:
    """A photo in the store. photo: its file. camera: the one that took it. taken: time, ISO 8601."""

    photo: Path
    camera: Camera
    taken: str


class PhotoStore:
    """The stored photos of a scene. folder: captures/{scene}."""

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)

    def photos_of(self, requested: Camera) -> list[StoredPhoto]:
        """Photos of a requested pose, oldest first. Raises: InputError: a file was changed since, by name."""
        return [_read_photo(place) for place in sorted((self.folder / pose_key(requested)).glob("[0-9]*"))]

    def add(self, photo: Path, agent: str, requested: tuple[Pose, Camera], camera: Camera, taken: str) -> StoredPhoto:
        """Copy a photo into the store, whole or not at all. camera: the one that took it."""
        pose, pinhole = requested
        home = self.folder / pose_key(pinhole)
        home.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".part-", dir=self.folder) as part:
            made = Path(part) / "shot"
            made.mkdir()
            name = f"photo{photo.suffix.lower()}"
            shutil.copyfile(photo, made / name)
            record = {"agent": agent, "pose": asdict(pose), "taken": taken, "source": photo.name, "photo": name}
            record |= {"asked": camera_to_json(pinhole), "got": camera_to_json(camera)}
            record["sha256"] = digest_files(made / name)
            write_json(made / "shot.json", record)
            numbers = [int(path.name) for path in home.glob("[0-9]*") if path.name.isdecimal()]
            place = home / f"{max(numbers, default=-1) + 1:03d}"  # after all that are there: the oldest come first
            made.rename(place)
        return _read_photo(place)

    def list_digests(self, requested: Iterable[Camera]) -> set[str]:
        """The digests of the stored photos of requested poses. Raises: InputError: a damaged record, by name."""
        homes = sorted({self.folder / pose_key(camera) for camera in requested})
        return {_read_record(path.parent)["sha256"] for home in homes for path in sorted(home.glob("[0-9]*/shot.json"))}

    @contextmanager
    def locked(self):
        """Hold the lock of the scene's devices. Raises: InputError: another run holds it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / ".lock").open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise InputError(f"{self.folder}: another run is taking photos of this scene; wait for it") from error
            yield self


def pose_key(camera: Camera) -> str:
    """A pose's folder name in the store: a digest of the camera's numbers."""
    numbers = [*camera.rotation.ravel(), *camera.translation, camera.fx, camera.fy, camera.cx, camera.cy]
    numbers += [camera.width, camera.height]
    rounded = np.round(np.array(numbers, float), PLACES) + 0.0  # + 0.0: no negative zeros
    return hashlib.sha256(rounded.astype("<f8").tobytes()).hexdigest()[:24]


def _read_photo(place: Path) -> StoredPhoto:
    record = _read_record(place)
    photo = place / record["photo"]
    if not photo.is_file() or digest_files(photo) != record["sha256"]:
        raise InputError(f"{photo}: is not the photo that was stored; put it back, or remove {place} to take it again")
    return StoredPhoto(photo, record["got"], record["taken"])


def _read_record(place: Path) -> dict:
    """What is used of a shot.json: `photo` (file name), `got` (camera), `sha256`, `taken`."""
    record = read_json(place / "shot.json")
    try:
        return {
            "photo": require_file_name(record["photo"]),
            "got": camera_from_json(record["got"]),
            "sha256": str(record["sha256"]),
            "taken": str(record["taken"]),
        }
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{place / 'shot.json'}: not the record of a photo ({summarize_error(error)}); put it back, or remove "
            f"{place} to take the photo again"
        ) from error


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
    shot_list_template: Path | str = ""
    requested: tuple[Camera, ...] = ()


def view_distance(a: Camera, b: Camera, frame: SceneFrame) -> float:
    """Distance of two views: between the centres in flying heights, plus the angle between the viewing directions in
    radians."""
    angle = np.arccos(np.clip(a.forward @ b.forward, -1, 1))
    return float(np.linalg.norm(a.centre - b.centre) / frame.flying_height + angle)
