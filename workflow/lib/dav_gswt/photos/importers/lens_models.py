"""Lens models: distorted cameras from the numbers in a file, fitted to photos, and the pinholes that replace them."""

import numpy as np
import pycolmap

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.lenses import make_camera

QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # turns the picture clockwise: right becomes down
TURNS = {1: 0, 6: 1, 3: 2, 8: 3}  # quarter turns clockwise that EXIF's orientation asks for; the others mirror
STRAY = 2.0  # pixels by which a pinhole's border may look past the photo's
_SWAPPED = {"fx": "fy", "fy": "fx", "cy": "cx"}


def make_lens(
    size: tuple[int, int], pinhole: tuple, k: tuple, p: tuple = (), fisheye: bool = False, where: str = ""
) -> pycolmap.Camera:
    """A lens by pinhole (fx, fy, cx, cy), up to four radial terms k, and OpenCV's two tangential ones p.

    After Brown: with x, y before the camera at depth 1 and r^2 = x^2 + y^2 the picture is at
    x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and y likewise with p1 and p2 exchanged.
    A fisheye, after Kannala and Brandt: a ray at the angle t off the axis lands at t (1 + k1 t^2 + ... + k4 t^8).
    """
    k1, k2, k3, k4 = (*k, 0.0, 0.0, 0.0, 0.0)[:4]
    p1, p2 = (*p, 0.0, 0.0)[:2]
    if fisheye:
        return make_camera("OPENCV_FISHEYE", *size, (*pinhole, k1, k2, k3, k4), where)
    if k3:
        return make_camera("FULL_OPENCV", *size, (*pinhole, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0), where)
    if k1 or k2 or p1 or p2:
        return make_camera("OPENCV", *size, (*pinhole, k1, k2, p1, p2), where)
    return make_camera("PINHOLE", *size, pinhole, where)


def fit_camera_to_photo(
    camera: pycolmap.Camera, stored: tuple[int, int], orientation: int, where: str
) -> tuple[pycolmap.Camera, int]:
    """The lens at the size of its photo as it is seen upright, and the quarter turns clockwise that this took.

    The photo may be a scaled copy of what the model was made of. stored: width and height before EXIF's orientation is
    applied: programs that make models do not apply it, so a lens that fits the stored picture is turned with it.
    Raises: InputError: another shape, or a mirroring orientation.
    """
    upright = (stored[1], stored[0]) if orientation >= 5 else stored
    if _same_shape(camera, stored):
        if orientation not in TURNS:
            raise InputError(f"{where}: its EXIF orientation mirrors it; save it upright and without that tag")
        camera = _scale_camera(camera, *stored)
        for _ in range(TURNS[orientation]):
            camera = _turn_camera(camera)
        return camera, TURNS[orientation]
    if _same_shape(camera, upright):
        return _scale_camera(camera, *upright), 0
    raise InputError(
        f"{where}: the photo has {upright[0]} x {upright[1]} pixels, its camera in the model {camera.width} x "
        f"{camera.height}, another shape; use the pictures that the model was made of (not cut, not undistorted)"
    )


def require_invertible(lens: pycolmap.Camera, pinhole: Camera, where: str) -> None:
    """Raises: InputError: the distortion of a lens folds over within the picture of its pinhole camera.

    What the pinhole sees must lie in the photo, and the way back must lead to the same ray.
    """
    params = [pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy]
    if np.isfinite(params).all() and min(params[:2]) > 0:
        x, y = np.meshgrid(np.linspace(0, pinhole.width, 17), np.linspace(0, pinhole.height, 17))
        rays = np.stack([(x - pinhole.cx) / pinhole.fx, (y - pinhole.cy) / pinhole.fy], -1).reshape(-1, 2)
        seen = np.asarray(lens.img_from_cam(np.c_[rays, np.ones(len(rays))]))
        back = np.asarray(lens.cam_from_img(np.ascontiguousarray(seen)))
        inside = (seen >= -STRAY) & (seen <= np.array([lens.width, lens.height]) + STRAY)
        if inside.all() and (np.abs(back - rays).max(1) * max(params[:2]) < 1).all():
            return
    raise InputError(
        f"{where}: the distortion of its camera cannot be undone over the whole picture (parameters "
        f"{lens.params_info}: {lens.params_to_string()}); check them, or calibrate again with fewer terms"
    )


def camera_key(camera: pycolmap.Camera) -> tuple:
    """What two equal lenses have in common."""
    return camera.model_name, camera.width, camera.height, *camera.params.tolist()


def _same_shape(camera: pycolmap.Camera, size: tuple[int, int]) -> bool:
    """Whether a size is the camera's times one factor, but for a rounded pixel of the smaller one."""
    (w, h), (u, v) = size, (camera.width, camera.height)
    return abs(h - w / u * v) <= max(1.0, w / u) or abs(w - h / v * u) <= max(1.0, h / v)


def _scale_camera(camera: pycolmap.Camera, width: int, height: int) -> pycolmap.Camera:
    camera = pycolmap.Camera(camera.todict())
    camera.rescale(width, height)
    return camera


def _turn_camera(camera: pycolmap.Camera) -> pycolmap.Camera:
    """The lens of the picture turned clockwise by 90 degrees: (x, y) is seen at (height - y, x).

    Radial terms stay; tangential and prism terms are vectors in the picture and turn with it.
    """
    names = camera.params_info.split(", ")
    old = dict(zip(names, camera.params.tolist(), strict=True))
    new = old | {a: old[b] for a, b in _SWAPPED.items() if a in old} | {"cx": camera.height - old["cy"]}
    vectors = [("p2", "p1"), ("sx1", "sy1")]  # OpenCV's p2 acts along x
    if camera.model_name == "RAD_TAN_THIN_PRISM_FISHEYE":
        vectors = [("p0", "p1"), ("s0", "s2"), ("s1", "s3")]
    for right, down in vectors:
        if right in old:
            new[right], new[down] = -old[down], old[right]
    params = [new[n] for n in names]
    return pycolmap.Camera(model=camera.model_name, width=camera.height, height=camera.width, params=params)
