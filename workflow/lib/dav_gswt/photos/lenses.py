"""The lenses of a photo set: how its pictures were undistorted, so that later photos are treated alike.

photos/lenses.json holds, for each lens, the distorted camera at the picture's size (a COLMAP camera model) and the
pinhole camera of its pictures. A scene without lenses.json has exact pinhole cameras: its photos are its pictures.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float32
from numpy import ndarray as Array
from pydantic import PositiveFloat
from scipy.ndimage import map_coordinates

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import parse_record, read_json, write_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files

FOCAL = (0.01, 1000.0)  # in longer sides: beyond, the number is in another unit
SAME = 1e-6  # pixels: two pinholes are one
ASPECT = 0.01  # a photo whose sides differ more from its lens's, as a share, is of another camera

Pinhole = tuple[float, float, float, float, float, float]  # fx, fy, cx, cy, width, height


@dataclass(frozen=True)
class Lens:
    """A distorted camera at the size of its pictures, and the pinhole (fx, fy, cx, cy, width, height) they have."""

    camera: pycolmap.Camera
    pinhole: Pinhole


@dataclass(frozen=True)
class StoredLens:
    """A lens as lenses.json has it. model, params: as COLMAP names and orders them."""

    model: str
    width: int
    height: int
    params: tuple[float, ...]
    pinhole: tuple[PositiveFloat, PositiveFloat, float, float, PositiveFloat, PositiveFloat]


def pinhole_parameters(camera: Camera) -> Pinhole:
    """What of a camera is its lens, not its place."""
    return (camera.fx, camera.fy, camera.cx, camera.cy, float(camera.width), float(camera.height))


def find_main_camera(cameras: Sequence[Camera]) -> Camera:
    """The first camera with the lens of most pictures; of equally common lenses the first. cameras: of all pictures."""
    kinds = [tuple(round(value, 5) for value in pinhole_parameters(camera)) for camera in cameras]
    return cameras[kinds.index(Counter(kinds).most_common(1)[0][0])]


def write_lenses(folder: Path | str, lenses: Sequence[Lens]) -> None:
    """Write lenses.json into a photos/ folder, the lens of most pictures first."""
    rows = []
    for lens in lenses:
        camera, params = lens.camera, tuple(lens.camera.params.tolist())
        rows.append(asdict(StoredLens(camera.model_name, camera.width, camera.height, params, lens.pinhole)))
    write_json(Path(folder) / "lenses.json", rows)


def read_lenses(folder: Path | str) -> list[Lens]:
    """The lenses of a photos/ folder; none where its cameras are exact pinholes.

    Raises: InputError: not such a file.
    """
    path = Path(folder) / "lenses.json"
    if not path.exists():
        return []
    try:
        rows = [parse_record(row, StoredLens) for row in read_json(path)]
    except (TypeError, ValueError) as error:
        problem = f"not as the workflow writes it ({summarize_error(error)})"
        raise InputError(f"{path}: {problem}; make the photos stage again") from error
    return [Lens(make_camera(row.model, row.width, row.height, row.params, str(path)), row.pinhole) for row in rows]


def make_camera(model: str, width: int, height: int, params: tuple[float, ...], where: str) -> pycolmap.Camera:
    """A camera of one of COLMAP's models. Raises: InputError: unknown, spherical, or numbers that no lens has."""
    if model not in pycolmap.CameraModelId.__members__ or model in ("INVALID", "EQUIRECTANGULAR"):
        raise InputError(f"{where}: pictures of a camera {model} are not read; export pictures of a perspective camera")
    if not (min(width, height) >= 1 and width * height <= image_files.MAX_PIXELS):
        most = image_files.MAX_PIXELS // 10**6
        raise InputError(f"{where}: pictures of {width} x {height} pixels; 1 pixel to {most} megapixels are read")
    camera = pycolmap.Camera(model=model, width=width, height=height, params=[float(v) for v in params])
    if not camera.verify_params() or not np.isfinite(camera.params).all():
        raise InputError(f"{where}: {model} needs finite numbers for {camera.params_info}, not {list(params)[:16]}")
    low, high = (side * max(width, height) for side in FOCAL)
    if not all(low <= f <= high for f in (camera.focal_length_x, camera.focal_length_y)):
        raise InputError(
            f"{where}: focal lengths {camera.focal_length_x:g}, {camera.focal_length_y:g} for {width} x {height} "
            "pixels; they must be positive and in pixels (of OpenSfM: in longer sides)"
        )
    return camera


def undistort_scene_photo(
    photo: Float32[Array, "h w 3"], folder: Path | str, camera: Camera
) -> Float32[Array, "r c 3"]:
    """The picture that the scene's pinhole `camera` would have taken, from a photo by the scene's lens.

    The camera may have been held upright where the scene's was not, or the other way round. Such a photo is turned to
    the sensor's shape, by a quarter counterclockwise, which takes EXIF's usual turn back. A phone that looks straight
    down writes any orientation.
    Raises: InputError: a photo of another shape, or of a lens that the scene does not have.
    """
    lenses = read_lenses(folder)
    own = next((lens for lens in lenses if np.allclose(lens.pinhole, pinhole_parameters(camera), atol=SAME)), None)
    if lenses and own is None:
        raise InputError(
            f"{folder}/lenses.json: has no lens of such a picture; take photos with the scene's own camera"
        )
    width, height = (own.camera.width, own.camera.height) if own else (camera.width, camera.height)
    if (photo.shape[0] > photo.shape[1]) != (height > width):
        photo = np.rot90(photo)
    if abs(photo.shape[1] * height / (photo.shape[0] * width) - 1) > ASPECT:
        raise InputError(
            f"a photo of {photo.shape[1]} x {photo.shape[0]} pixels is not of the scene's camera "
            f"({width} x {height}); take photos with the same camera, uncropped"
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
