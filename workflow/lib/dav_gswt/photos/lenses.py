"""The lenses of a photo set: how its pictures were undistorted, so that later photos are treated alike.

photos/lenses.json holds, for each lens, the distorted camera at the picture's size (a COLMAP camera model) and the
pinhole camera of its pictures. A scene without lenses.json has exact pinhole cameras: its photos are its pictures.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float32
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import read_json, write_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files

SAME = 1e-6  # pixels: two pinholes are one
ASPECT = 0.01  # a photo whose sides differ more from its lens's, as a share, is of another camera


@dataclass(frozen=True)
class Lens:
    """A distorted camera at the size of its pictures, and the pinhole (fx, fy, cx, cy, width, height) they have."""

    camera: pycolmap.Camera
    pinhole: tuple[float, ...]


def pinhole_parameters(camera: Camera) -> tuple[float, ...]:
    """What of a camera is its lens, not its place."""
    return (camera.fx, camera.fy, camera.cx, camera.cy, float(camera.width), float(camera.height))


def find_main_camera(cameras: Sequence[Camera]) -> Camera:
    """The first camera with the lens of most pictures; of equally common lenses the first. cameras: of all pictures."""
    kinds = [tuple(round(value, 5) for value in pinhole_parameters(camera)) for camera in cameras]
    return cameras[kinds.index(Counter(kinds).most_common(1)[0][0])]


def write_lenses(folder: Path | str, lenses: Sequence[Lens]) -> None:
    """Write lenses.json into a photos/ folder, the lens of most pictures first."""
    rows = [
        {
            "model": lens.camera.model_name,
            "width": lens.camera.width,
            "height": lens.camera.height,
            "params": [float(v) for v in lens.camera.params],
            "pinhole": list(lens.pinhole),
        }
        for lens in lenses
    ]
    write_json(Path(folder) / "lenses.json", rows)


def read_lenses(folder: Path | str) -> list[Lens]:
    """The lenses of a photos/ folder; none where its cameras are exact pinholes.

    Raises: InputError: not such a file.
    """
    path = Path(folder) / "lenses.json"
    if not path.exists():
        return []
    try:
        return [_parse_lens(row) for row in read_json(path)]
    except (KeyError, TypeError, ValueError, OverflowError, RuntimeError) as error:
        raise InputError(
            f"{path}: not as the workflow writes it ({summarize_error(error)}); make the photos stage again"
        ) from error


def _parse_lens(row: dict) -> Lens:
    if row["model"] not in pycolmap.CameraModelId.__members__ or row["model"] == "INVALID":
        raise ValueError(f"{str(row['model'])[:40]} is no camera model")
    camera = pycolmap.Camera(
        model=row["model"], width=row["width"], height=row["height"], params=np.array(row["params"], float)
    )
    pinhole = tuple(map(float, row["pinhole"]))
    if not camera.verify_params() or len(pinhole) != 6 or not np.isfinite([*camera.params, *pinhole]).all():
        raise ValueError("a lens lacks numbers")
    if not 0 < camera.width * camera.height <= image_files.MAX_PIXELS or not min(pinhole[0], pinhole[1]) > 0:
        raise ValueError("a number of a lens is out of range")
    return Lens(camera, pinhole)


def undistort_scene_photo(
    photo: Float32[Array, "h w 3"], folder: Path | str, camera: Camera
) -> Float32[Array, "r c 3"]:
    """The picture that the scene's pinhole `camera` would have taken, from a photo by the scene's lens.

    Raises: InputError: a photo of another shape, or of a lens that the scene does not have.
    """
    lenses = read_lenses(folder)
    own = next((lens for lens in lenses if np.allclose(lens.pinhole, pinhole_parameters(camera), atol=SAME)), None)
    if lenses and own is None:
        raise InputError(
            f"{folder}/lenses.json: has no lens of such a picture; take photos with the scene's own camera"
        )
    width, height = (own.camera.width, own.camera.height) if own else (camera.width, camera.height)
    if abs(photo.shape[1] * height / (photo.shape[0] * width) - 1) > ASPECT:
        raise InputError(
            f"a photo of {photo.shape[1]} x {photo.shape[0]} pixels is not of the scene's camera "
            f"({width} x {height}); take photos with the same camera, uncropped and not turned"
        )
    photo = image_files.shrink_image(photo, width, height)
    return undistort_photo(photo, own.camera, camera) if own else photo


def undistort_photo(photo: Float32[Array, "h w 3"], lens: pycolmap.Camera, camera: Camera) -> Float32[Array, "r c 3"]:
    """A photo as a pinhole camera would have taken it: cubic splines, each channel alone. lens: of the photo's size."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = np.stack([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)], -1).reshape(-1, 3)
    column, row = (np.asarray(lens.img_from_cam(rays)) - 0.5).T.reshape(2, camera.height, camera.width)
    planes = [map_coordinates(photo[..., c], [row, column], order=3, mode="nearest") for c in range(3)]
    return np.clip(np.stack(planes, -1), 0, 1).astype(np.float32)
