"""The photos that a round's field was made of."""

import logging
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.capture_record import read_capture_record

if TYPE_CHECKING:
    from dav_gswt.photos.colmap_model import ColmapModel  # loads pycolmap

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TakenPhoto:
    """A photo by the name that it leaves under.

    source: its file, undistorted. camera: the pinhole that took it. round: in which it was taken; 0: to start from.
    """

    name: str
    source: Path
    camera: Camera
    round: int


def list_taken_photos(
    images: Path | str, known: "ColmapModel", start: Sequence[str], captures: Sequence, rejected: Collection[str] = ()
) -> list[TakenPhoto]:
    """The start views, then the photos of every capture folder, in their order, without the rejected ones.

    A name that is taken already gets the number of its capture folder in front.
    Raises: InputError: see `read_capture_record`, or a start view that the model does not have.
    """
    photos = [TakenPhoto(name, Path(images) / name, known.camera(name), 0) for name in start]
    names = set(start)
    for number, folder in enumerate(captures, 1):
        for shot in read_capture_record(folder):
            if shot.name in rejected:
                _log.info("%s contradicted the other photos and is left out, as in the fit", shot.name)
                continue
            name = f"iter{number}_{shot.name}" if shot.name in names else shot.name
            names.add(name)
            photos.append(TakenPhoto(name, Path(folder) / shot.name, shot.camera, number))
    return photos
