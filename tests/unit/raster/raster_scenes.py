"""Small Gaussians to draw, and the oracle's answers about them."""

import numpy as np
import torch

from dav_gswt import cameras
from dav_gswt.raster import oracle
from dav_gswt.stability.drawing import cloud

NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours")


gaussians = cloud  # as the page of extremes draws


def one(z: float = 0.0, scale=0.1, opacity: float = 0.5, x: float = 0.05, y: float = -0.05, colour=(1.0, 0.5, 0.25)):
    """A single axis-aligned Gaussian, by default in the middle of the pixel (row 8, column 8) of `map_camera`."""
    return {
        "means": np.array([[x, y, z]], np.float32),
        "log_scales": np.log(np.broadcast_to(np.asarray(scale, np.float64), (1, 3))).astype(np.float32),
        "quats": np.array([[1, 0, 0, 0]], np.float32),
        "opacity_logits": np.array([np.log(opacity / (1 - opacity))], np.float32),
        "colours": np.array([colour], np.float32),
    }


def together(*parts: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: np.concatenate([p[name] for p in parts]) for name in NAMES}


def taken(arrays: dict[str, np.ndarray], index) -> dict[str, np.ndarray]:
    return {name: np.ascontiguousarray(a[index]) for name, a in arrays.items()}


def map_camera(size: int = 16) -> cameras.Camera:
    """From height 2 straight down, 10 pixels a unit: rows run south, columns east, the origin is the middle corner."""
    return cameras.top_down(-size / 20, -size / 20, size, size, 0.1, 2.0)


# neither size is a multiple of a tile's, and the pinhole's principal point is not in the middle
PINHOLE = cameras.Camera(*cameras.look_at((0.3, -4, 1.5), (0, 0, 0)), 60.0, 55.0, 33.0, 29.0, 70, 52)
CAMERAS = {"pinhole": PINHOLE, "orthographic": cameras.top_down(-2.0, -1.5, 70, 52, 4 / 70, 5.0)}


def image_gradients(camera: cameras.Camera, channels: int, seed: int = 1) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    size = camera.height, camera.width
    return tuple(rng.normal(size=shape).astype(np.float32) for shape in ((*size, channels), size, size))


def oracle_answers(arrays, camera, gradients, **options):
    """Colour, alpha and depth by the oracle, and its gradients of the images' scalar product with `gradients`."""
    leaves = {k: torch.tensor(v, dtype=torch.float64, requires_grad=True) for k, v in arrays.items()}
    images = oracle.forward(**leaves, camera=camera, **options)
    pairs = zip(images, gradients, strict=True)
    sum((i * torch.as_tensor(g, dtype=torch.float64)).sum() for i, g in pairs if g is not None).backward()
    return [i.detach().numpy() for i in images], {k: v.grad.numpy() for k, v in leaves.items()}


def relative(found: np.ndarray, wanted: np.ndarray) -> float:
    """Length of the difference over the length of what is wanted."""
    return float(np.linalg.norm(found.astype(float) - wanted) / np.linalg.norm(wanted))
