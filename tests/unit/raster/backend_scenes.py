"""Scenes that all backends must draw alike, and the oracle's answers about them in float64."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
import torch
from raster_scenes import CAMERAS, gaussians, image_gradients

from dav_gswt import cameras
from dav_gswt.cameras import Camera
from dav_gswt.raster import oracle


@dataclass(frozen=True)
class Scene:
    """image, gradient: tolerances of a backend in float32, the first of a picture's maximum, the second of the length
    of each parameter's gradient. loose: the same for cuda on a real GPU, by its docstring."""

    arrays: dict[str, np.ndarray]
    camera: Camera
    options: dict = field(default_factory=dict)
    image: float = 2e-5  # some hundred roundings of 6e-8 a pixel
    gradient: float = 2e-5
    loose: tuple[float, float] = (1e-3, 1e-2)


def cloud(n: int = 250, seed: int = 0, **more) -> dict[str, np.ndarray]:
    """A cloud whose opacities stay below .99, where gsplat clamps otherwise."""
    arrays = gaussians(n, seed)
    arrays["opacity_logits"] = arrays["opacity_logits"].clip(max=4.5)
    return arrays | more


def normal(*shape: int, seed: int = 7) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape).astype(np.float32)


def ground(n: int = 40) -> dict[str, np.ndarray]:
    """n x n overlapping flat discs on uneven ground: what a field mostly is."""
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    arrays = cloud(n * n)
    arrays["means"] = np.stack([x.ravel(), y.ravel(), 0.05 * normal(n * n)], 1).astype(np.float32)
    arrays["log_scales"] = np.tile(np.log([0.03, 0.03, 0.004]).astype(np.float32), (n * n, 1))
    arrays["quats"] = (np.array([1, 0, 0, 0]) + 0.1 * normal(n * n, 4)).astype(np.float32)
    arrays["opacity_logits"] = np.full(n * n, 3, np.float32)
    return arrays


PINHOLE, MAP = CAMERAS["pinhole"], CAMERAS["orthographic"]
WALKER = cameras.pinhole((0, -1.1, 0.15), (0, 0.5, 0), 72, 40, 70.0)
SCENES = {
    "a cloud": Scene(cloud(), PINHOLE),
    "a cloud on a map": Scene(cloud(), MAP),
    "a ground seen from low down": Scene(ground(), WALKER),
    "two channels": Scene(cloud(colours=normal(250, 2)), PINHOLE),
    "harmonics of degree 0": Scene(cloud(colours=normal(250, 1, 3)), PINHOLE),
    "harmonics of degree 1": Scene(cloud(colours=normal(250, 4, 3)), PINHOLE),
    "harmonics of degree 2": Scene(cloud(colours=normal(250, 9, 3)), PINHOLE),
    "harmonics of degree 3": Scene(cloud(colours=normal(250, 16, 3)), PINHOLE),
    "harmonics on a map": Scene(cloud(colours=normal(250, 9, 3)), MAP),
    "features": Scene(cloud(features=normal(250, 5)), PINHOLE),
    "features beside harmonics": Scene(cloud(features=normal(250, 1), colours=normal(250, 4, 3)), PINHOLE),
    "antialiased": Scene(cloud(), PINHOLE, {"antialiased": True}),
    "antialiased on a map": Scene(cloud(), MAP, {"antialiased": True, "dilation": 1.0}),
    "another dilation and near plane": Scene(cloud(), PINHOLE, {"dilation": 0.1, "near": 4.0}),
    # along a needle terms of some 1e4 cancel in the exponent where it is not a sum of squares
    "needles": Scene(
        cloud(60, log_scales=np.log([[1e3, 1e-3, 1e-3]]).repeat(60, 0).astype(np.float32)),
        PINHOLE, image=1e-3, gradient=1e-2, loose=(0.1, 1.0),
    ),
    # gsplat's alpha reaches .999: its pictures may differ by .009 of a colour, its gradients by as much as they like
    "opacities up to 1": Scene(gaussians(250), PINHOLE, loose=(1e-2, np.inf)),
}  # fmt: skip


@cache
def answers(name: str):
    """Of a scene: pictures, random gradients by them, and the gradients by all parameters and the camera."""
    scene = SCENES[name]
    leaves = {k: torch.tensor(v, dtype=torch.float64, requires_grad=True) for k, v in scene.arrays.items()}
    motion = torch.zeros(6, dtype=torch.float64, requires_grad=True)
    pictures = oracle.forward(**leaves, camera=scene.camera, motion=motion, **scene.options)
    shown = image_gradients(scene.camera, pictures[0].shape[2])
    if len(pictures) > 3:
        shown += (normal(*pictures[3].shape),)
    total = sum((p * torch.as_tensor(g)).sum() for p, g in zip(pictures, shown, strict=True))
    total.backward()
    gradients = {name: leaf.grad.numpy() for name, leaf in (leaves | {"camera": motion}).items()}
    return [p.detach().numpy() for p in pictures], shown, gradients


@cache
def blend_weights(name: str) -> np.ndarray:
    """Of a scene: one row a pixel, one column a Gaussian."""
    scene = SCENES[name]
    given = {k: torch.tensor(v, dtype=torch.float64) for k, v in scene.arrays.items() if k != "features"}
    view = oracle.moved(scene.camera, None, given["means"])
    splats = oracle.project(**given, camera=scene.camera, view=view, **scene.options)
    x, y = np.meshgrid(np.arange(scene.camera.width) + 0.5, np.arange(scene.camera.height) + 0.5)
    found = np.zeros((x.size, len(given["means"])))
    found[:, splats.index] = oracle.weights(splats, torch.as_tensor(np.stack([x.ravel(), y.ravel()], 1)))
    return found
