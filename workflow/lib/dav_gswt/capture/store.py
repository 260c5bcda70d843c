"""Photos that a device took, kept for good: outside any rule's outputs, by pose, added to and never changed.

captures/{scene}/{key}/{n}/ holds a photo as the device delivered it and shot.json. A round that is asked for the same
pose again, because something before it was computed anew or a run was killed, finds the photos here and takes none.
"""

import fcntl
import hashlib
import shutil
import tempfile
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.files import digest, read_json, write_json
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose

PLACES = 6  # decimals of a camera's numbers that tell poses apart: far below what a device can repeat


@dataclass(frozen=True)
class Stored:
    """A photo in the store. photo: its file. got: the camera that took it. taken: when, ISO 8601."""

    photo: Path
    got: Camera
    taken: str


class Store:
    """A scene's photos by devices. folder: captures/{scene}."""

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)

    def of(self, asked: Camera) -> list[Stored]:
        """The photos taken for a pose, oldest first. Raises: InputError: one that was changed since, by name."""
        return [_read(place) for place in sorted((self.folder / key(asked)).glob("[0-9]*"))]

    def add(self, photo: Path, agent: str, pose: Pose, asked: Camera, got: Camera, taken: str) -> Stored:
        """Keep a photo: whole or not at all, beside those of the same pose."""
        home = self.folder / key(asked)
        home.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".part-", dir=self.folder) as part:
            made = Path(part) / "shot"
            made.mkdir()
            name = f"photo{photo.suffix.lower()}"
            shutil.copyfile(photo, made / name)
            record = {"agent": agent, "pose": asdict(pose), "taken": taken, "source": photo.name, "photo": name}
            record |= {"asked": cameras.to_json(asked), "got": cameras.to_json(got), "sha256": digest(made / name)}
            write_json(made / "shot.json", record)
            place = home / f"{len(list(home.glob('[0-9]*'))):03d}"
            made.rename(place)
        return _read(place)

    def records(self) -> list[dict]:
        """Every photo's shot.json."""
        return [read_json(path) for path in sorted(self.folder.glob("*/[0-9]*/shot.json"))]

    @contextmanager
    def locked(self):
        """One device at a time, and one run. Raises: InputError: another run holds the device."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / ".lock").open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise InputError(f"{self.folder}: another run is taking photos of this scene; wait for it") from error
            yield self


def key(camera: Camera) -> str:
    """A pose's name in the store: a digest of where the camera stands, how it is turned and what it resolves."""
    numbers = [*camera.rotation.ravel(), *camera.translation, camera.fx, camera.fy, camera.cx, camera.cy]
    numbers += [camera.width, camera.height]
    rounded = np.round(np.array(numbers, float), PLACES) + 0.0  # + 0.0: no negative zeros
    return hashlib.sha256(rounded.astype("<f8").tobytes()).hexdigest()[:24]


def _read(place: Path) -> Stored:
    record = read_json(place / "shot.json")
    photo = place / record["photo"]
    if not photo.is_file() or digest(photo) != record["sha256"]:
        raise InputError(f"{photo}: is not the photo that was stored; put it back, or remove {place} to take it again")
    return Stored(photo, cameras.from_json(record["got"]), record["taken"])
