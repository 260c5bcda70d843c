"""Reader of COLMAP's sparse models, binary or text: cameras, images and points.

pycolmap trusts the counts in a binary file, so they are compared with the size of the file first.
Rigs and frames are not read, as they repeat what the images say. Formats:
colmap.github.io/format.html.
"""

import struct
import tempfile
from pathlib import Path

import pycolmap

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.photos.importers import checks
from dav_gswt.photos.importers.checks import ImportedImage, ImportedModel
from dav_gswt.photos.lenses import make_camera
from dav_gswt.photos.recognition import find_colmap_ending

_PARTS = ("cameras", "images", "points3D")
_MODELS = {int(number): name for name, number in pycolmap.CameraModelId.__members__.items() if name != "INVALID"}
_COUNTS = {k: len(pycolmap.Camera.create_from_model_name(1, n, 1.0, 1, 1).params) for k, n in _MODELS.items()}


def import_colmap(folder: Path) -> ImportedModel:
    """Read a model. Raises: InputError: damaged, or what it says cannot be."""
    kind = find_colmap_ending(folder)
    files = {part: folder / f"{part}.{kind}" for part in _PARTS}
    stored = _read_reconstruction(files)
    cameras = {
        number: make_camera(c.model_name, c.width, c.height, tuple(c.params), f"{files['cameras']}: camera {number}")
        for number, c in sorted(stored.cameras.items())
    }
    images = []
    for number, image in sorted(stored.images.items()):
        name = checks.check_image_name(image.name, str(files["images"]))
        pose = checks.check_pose(image.cam_from_world().matrix(), f"{files['images']}: image {name}")
        images.append(ImportedImage(name, cameras[image.camera_id], *pose, number))
    return ImportedModel(tuple(images), stored)


def _read_reconstruction(files: dict[str, Path]) -> pycolmap.Reconstruction:
    """The model by pycolmap, from a folder of links to these files alone."""
    with tempfile.TemporaryDirectory(prefix="colmap-") as links:
        for part, path in files.items():
            link = Path(links) / path.name
            if part == "points3D" and not path.is_file():
                link.write_bytes(bytes(8) if path.suffix == ".bin" else b"")
                continue
            checks.check_size(path, checks.LARGEST)
            if path.suffix == ".bin":
                _check_counts(path, part)
            link.symlink_to(path.absolute())
        try:
            return pycolmap.Reconstruction(links)
        except Exception as error:  # the library raises what its C++ does
            where, why = files["images"].with_stem("*"), summarize_error(error).replace(f"{links}/", "")
            raise InputError(f"{where}: not readable as a COLMAP model ({why}); copy or export it again") from error


def _check_counts(path: Path, part: str) -> None:
    """Walk over the records of a binary file. Raises: InputError: they do not end where the file does."""
    data, at = path.read_bytes(), 0

    def take(form: str) -> tuple:
        nonlocal at
        at += struct.calcsize("<" + form)
        return struct.unpack_from("<" + form, data, at - struct.calcsize("<" + form))

    try:
        for _ in range(take("Q")[0]):
            if part == "cameras":
                rest = 8 * _COUNTS[take("IiQQ")[1]]
            elif part == "images":
                take("I7dI")
                at = data.index(b"\0", at, at + checks.LONGEST_NAME) + 1
                rest = 24 * take("Q")[0]
            else:
                rest = 8 * take("Q3d3BdQ")[-1]
            at += rest
    except (struct.error, KeyError, ValueError, OverflowError):
        at = -1
    if at != len(data):
        raise InputError(f"{path}: cut short or damaged; copy or export it again")
