"""Made-up models and photos of a flat ground, for the tests beside this file."""

import numpy as np

from dav_gswt import images
from dav_gswt.cameras import Camera, look_at
from dav_gswt.photos.model import Model

WIDTH, HEIGHT, FOCAL = 320, 240, 300.0


def camera(eye, target=None) -> Camera:
    """A small pinhole camera at `eye`; it looks straight down where no target is given."""
    eye = np.asarray(eye, float)
    target = eye - [0, 0, 1] if target is None else np.asarray(target, float)
    rotation, translation = look_at(eye, target)
    return Camera(rotation, translation, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)


def flight(rows: int, columns: int, step: float = 0.25, height: float = 1.0, tilt: float = 0.05) -> list[Camera]:
    """Cameras in flight lines over the origin, each looking a little towards it."""
    places = [
        ((j - (columns - 1) / 2) * step, (i - (rows - 1) / 2) * step) for i in range(rows) for j in range(columns)
    ]
    return [camera((x, y, height), (x * (1 - tilt), y * (1 - tilt) + 1e-3, 0)) for x, y in places]


def model(cameras: list[Camera], points: np.ndarray, noise: float = 0.0, rng=None) -> Model:
    """The model that exact matching gives: every camera sees every point inside its picture, `noise` pixels off."""
    point_of, image_of, pixels = [], [], []
    for i, view in enumerate(cameras):
        at, depth = view.project(points)
        seen = np.flatnonzero((depth > 0) & (at > 0).all(1) & (at[:, 0] < view.width) & (at[:, 1] < view.height))
        point_of.append(seen)
        image_of.append(np.full(len(seen), i))
        pixels.append(at[seen] + (rng.normal(0, noise, (len(seen), 2)) if noise else 0.0))
    order = np.lexsort((np.concatenate(image_of), np.concatenate(point_of)))
    return Model(
        tuple(f"{i:03d}.png" for i in range(len(cameras))),
        tuple(cameras),
        points,
        np.tile(np.float32([0.2, 0.4, 0.6]), (len(points), 1)),
        np.concatenate(point_of)[order],
        np.concatenate(image_of)[order],
        np.concatenate(pixels)[order],
    )


def plain(n: int, half: float, rng, relief: float = 0.0) -> np.ndarray:
    """Points on the plane z = 0 within a square, `relief` (standard deviation) off it."""
    return np.c_[rng.uniform(-half, half, (n, 2)), rng.normal(0, relief, n) if relief else np.zeros(n)]


def texture(rng, size: int = 900) -> np.ndarray:
    """A ground picture with detail at every scale, as sand and stones have: a sum of blurred noise."""
    grey = np.zeros((size, size))
    for octave in range(1, 7):
        cells = size // 2**octave
        grey += np.kron(rng.random((cells + 1, cells + 1)), np.ones((2**octave, 2**octave)))[:size, :size] * octave**0.5
    grey = (grey - grey.min()) / np.ptp(grey)
    return np.stack([grey, grey**1.2, grey**1.5], -1).astype(np.float32)


def photograph(view: Camera, ground: np.ndarray, half: float) -> np.ndarray:
    """What a camera sees of a picture laid on z = 0 over the square of half side `half`, by bilinear sampling."""
    origin, step = view.rays()
    x, y = np.moveaxis((origin - origin[..., 2:] / step[..., 2:] * step)[..., :2], -1, 0)
    size = len(ground)
    u = np.clip((x + half) / (2 * half) * size - 0.5, 0, size - 1.001)
    v = np.clip((half - y) / (2 * half) * size - 0.5, 0, size - 1.001)
    i, j = v.astype(int), u.astype(int)
    a, b = (v - i)[..., None], (u - j)[..., None]
    top = ground[i, j] * (1 - b) + ground[i, j + 1] * b
    return (top * (1 - a) + (ground[i + 1, j] * (1 - b) + ground[i + 1, j + 1] * b) * a).astype(np.float32)


def shoot(folder, cameras: list[Camera], ground: np.ndarray, half: float) -> None:
    """Photos of the ground in a folder, one for each camera."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, view in enumerate(cameras):
        images.write(folder / f"{i:03d}.png", photograph(view, ground, half))
