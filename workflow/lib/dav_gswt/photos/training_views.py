"""Training views: a photo with its camera at the size of a preset, and a weight per pixel for the fit."""

import mmap
import resource
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.view_split import find_ground_pixels

WHOLE = 0.99  # of a shrunk pixel that must not be masked for it to count
IN_MEMORY = 300e6  # bytes of all photos, beyond which they lie in files (a fit holds them about four times)
OPEN_FILES = 10_000  # of the process, at most; one for each array in a file


class ArrayFile:
    """Stores arrays in unnamed files of a folder, so that photos need not fit into memory.

    The files vanish with the arrays, or when the process ends. Stored arrays are read-only maps of
    them. What was read stays in memory until it is released (`release_pages`) or the system needs
    the room.
    """

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        now, most = resource.getrlimit(resource.RLIMIT_NOFILE)  # each map keeps its file open
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(now, min(most, OPEN_FILES)), most))

    def store(self, array: Array) -> Array:
        """The array's bytes on disk, as a read-only array. Raises: OSError: the disk is full."""
        if not array.nbytes:
            return array
        with tempfile.TemporaryFile(dir=self.folder) as file:
            file.write(np.ascontiguousarray(array).data)
            file.flush()
            return np.asarray(np.memmap(file, array.dtype, "r", shape=array.shape))


def release_pages(array: Array) -> None:
    """Give back the memory that reading an array of an ArrayFile took, until it is read again; nothing for others."""
    while isinstance(array.base, Array):
        array = array.base
    if isinstance(array.base, mmap.mmap):
        array.base.madvise(mmap.MADV_DONTNEED)


@dataclass(frozen=True)
class TrainingView:
    """A photo and its camera on the same pixel grid.

    weight: 1 where the photo counts, 0 where it is not fitted. behind: the colour behind all that can be modelled, NaN
    where that is not known; None: nowhere. arrays: where they lie, if not in memory.
    """

    name: str
    camera: Camera
    image: Float32[Array, "h w 3"]
    weight: Float32[Array, "h w"]
    behind: Float32[Array, "h w 3"] | None = None
    arrays: ArrayFile | None = None

    def with_pixels(self, **changed: Array) -> "TrainingView":
        """The view with another image, weight or behind, which lies where its arrays do."""
        if self.arrays is not None:
            changed = {name: self.arrays.store(array) for name, array in changed.items()}
        return replace(self, **changed)

    def release(self) -> None:
        """Give back the memory that reading the arrays took; nothing for arrays in memory."""
        for array in (self.image, self.weight, self.behind):
            if self.arrays is not None and array is not None:
                release_pages(array)


def one_by_one(views: Iterable[TrainingView]) -> Iterator[TrainingView]:
    """The views, each released when the next one is asked for."""
    for view in views:
        yield view
        view.release()


def read_training_view(
    name: str, camera: Camera, path: Path | str, size: int, arrays: ArrayFile | None = None
) -> TrainingView:
    """The view of a picture file, at most `size` pixels wide or high; photos are never enlarged.

    What its alpha masks does not count. arrays: where it lies; None: in memory.
    Raises: InputError: not readable as an image, or smaller than the camera's picture.
    """
    image, cover = image_files.read_photo_and_alpha(path)
    if image.shape[0] < camera.height or image.shape[1] < camera.width:
        raise InputError(
            f"{path}: {image.shape[1]} x {image.shape[0]} pixels, its camera takes {camera.width} x {camera.height}; "
            "make the photos again"
        )
    width, height = image_files.fit_size(camera.width, camera.height, size)
    if (width, height) != (camera.width, camera.height):
        image, camera = image_files.shrink_image(image, width, height), camera.resized(width, height)
        cover = image_files.shrink_image(cover[..., None], width, height)[..., 0]
    weight = (cover > WHOLE).astype(np.float32)
    return TrainingView(name, camera, image, weight, arrays=arrays).with_pixels(image=image, weight=weight)


def mask_outside_ground(view: TrainingView, west: float, south: float, east: float, north: float) -> TrainingView:
    """The view with weight 0 where its ray does not meet the plane z = 0 inside the rectangle."""
    hit = find_ground_pixels(view.camera, (west, south, east, north))
    return view.with_pixels(weight=view.weight * hit.astype(np.float32))


def read_training_views(
    images_folder: Path | str,
    model: Path | str,
    names: Sequence[str],
    captures: Sequence[Path | str],
    size: int,
    files: Path | str | None = None,
) -> list[TrainingView]:
    """The photos captured so far: those named in the model, then every capture folder's, in their order.

    files: a folder in which they lie, without a name, if they are too many for memory; None: in memory.
    """
    from dav_gswt.photos.colmap_model import read_colmap_model  # not above: it loads pycolmap

    known = read_colmap_model(model)
    photos = [(name, known.camera(name), Path(images_folder) / name) for name in names]
    for folder in captures:
        photos += [(shot.name, shot.camera, Path(folder) / shot.name) for shot in read_capture_record(folder)]
    sides = [image_files.fit_size(camera.width, camera.height, size) for _, camera, _ in photos]
    large = sum(12 * width * height for width, height in sides) > IN_MEMORY
    arrays = ArrayFile(files) if files is not None and large else None
    return [read_training_view(name, camera, path, size, arrays) for name, camera, path in photos]
