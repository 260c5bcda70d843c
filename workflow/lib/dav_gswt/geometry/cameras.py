"""Cameras in COLMAP's convention: x right, y down, z forward, pixel centres at half integers."""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


@dataclass(frozen=True)
class Camera:
    """A pinhole or an orthographic camera.

    A world point p has camera coordinates q = rotation @ p + translation. A pinhole sees it at
    (fx q_x / q_z + cx, fy q_y / q_z + cy), an orthographic camera at (fx q_x + cx, fy q_y + cy),
    where fx and fy are then pixels per world unit. Depth is q_z in both.
    """

    rotation: Float[Array, "3 3"]
    translation: Float[Array, "3"]
    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    orthographic: bool = False

    @property
    def centre(self) -> Float[Array, "3"]:
        """The camera's position in the world."""
        return -self.rotation.T @ self.translation

    @property
    def forward(self) -> Float[Array, "3"]:
        """The unit viewing direction in the world."""
        return self.rotation[2]

    def resized(self, width: int, height: int) -> "Camera":
        """The same view sampled on another pixel grid."""
        x, y = width / self.width, height / self.height
        return replace(self, fx=self.fx * x, fy=self.fy * y, cx=self.cx * x, cy=self.cy * y, width=width, height=height)

    def project(self, points: Float[Array, "n 3"]) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
        """Pixel positions and depths. Pixels of points at or behind the camera mean nothing: test the depth."""
        q = points @ self.rotation.T + self.translation
        scale = 1.0 if self.orthographic else 1.0 / np.where(q[:, 2:] > 1e-9, q[:, 2:], 1.0)
        return q[:, :2] * scale * [self.fx, self.fy] + [self.cx, self.cy], q[:, 2]

    def rays(self) -> tuple[Float[Array, "h w 3"], Float[Array, "h w 3"]]:
        """Origin and direction of the ray through every pixel's centre; depth grows by 1 along a direction."""
        x = (np.arange(self.width) + 0.5 - self.cx) / self.fx
        y = (np.arange(self.height) + 0.5 - self.cy) / self.fy
        x, y = np.meshgrid(x, y)
        zero, one = np.zeros_like(x), np.ones_like(x)
        across, ahead = np.stack([x, y, zero], -1), np.stack([zero, zero, one], -1)
        offset, step = (across, ahead) if self.orthographic else (0 * across, across + ahead)
        return self.centre + offset @ self.rotation, step @ self.rotation


def look_at(eye, target, up=(0.0, 0.0, 1.0)) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Rotation and translation of a camera at `eye` that looks at `target` with `up` upwards in the picture.

    Looking straight along `up` the picture's top is the world's +y.
    Raises: ValueError: eye and target coincide.
    """
    eye, target, up = (np.asarray(v, float) for v in (eye, target, up))
    forward = target - eye
    length = np.linalg.norm(forward)
    if not length > 0:
        raise ValueError("eye and target of a camera coincide")
    forward = forward / length
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-9:
        right = np.cross(forward, [0.0, 1.0, 0.0])
    right = right / np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return rotation, -rotation @ eye


def pinhole(eye, target, width: int, height: int, fov_degrees: float | int, up=(0.0, 0.0, 1.0)) -> Camera:
    """A pinhole camera as of `look_at`; the field of view is measured across the picture's width."""
    rotation, translation = look_at(eye, target, up)
    focal = 0.5 * width / np.tan(0.5 * np.radians(fov_degrees))
    return Camera(rotation, translation, focal, focal, width / 2, height / 2, width, height)


def top_down(west: float, south: float, width: int, height: int, cell: float, top: float) -> Camera:
    """An orthographic map camera at height `top`: x grows with columns, y falls with rows, `cell` units a pixel.

    The map's first row is its northern one, as in any image of a map.
    """
    eye = np.array([west + 0.5 * width * cell, south + 0.5 * height * cell, top])
    rotation = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
    return Camera(rotation, -rotation @ eye, 1 / cell, 1 / cell, width / 2, height / 2, width, height, True)


def camera_to_json(camera: Camera) -> dict:
    """A camera as plain JSON values."""
    values = {f.name: getattr(camera, f.name) for f in fields(Camera)}
    return values | {"rotation": camera.rotation.tolist(), "translation": camera.translation.tolist()}


def camera_from_json(values: dict) -> Camera:
    """The camera that `camera_to_json` wrote. Raises: KeyError, TypeError or ValueError: not such values."""
    rotation, translation = np.array(values["rotation"], float), np.array(values["translation"], float)
    lens = [values[key] for key in ("fx", "fy", "cx", "cy", "width", "height")]
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in lens)
    if not numbers or not all(isinstance(size, int) and size > 0 for size in lens[4:]):
        raise TypeError("a camera's lens is none")
    if rotation.shape != (3, 3) or translation.shape != (3,) or not np.allclose(rotation @ rotation.T, np.eye(3)):
        raise ValueError("a camera's rotation is none")
    if not np.isfinite([*translation, *lens]).all() or not min(lens[:2]) > 0:
        raise ValueError("a number of a camera is out of range")
    fx, fy, cx, cy = map(float, lens[:4])
    width, height = lens[4:]
    return Camera(rotation, translation, fx, fy, cx, cy, width, height, values.get("orthographic") is True)
