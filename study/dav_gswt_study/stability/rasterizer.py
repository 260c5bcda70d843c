"""Checks of the rasterizer in use against the float64 oracle, at the extremes of its inputs."""

import numpy as np
from fixtures.raster_scenes import draw_by_oracle, random_cloud
from numpy import ndarray as Array

from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import make_rasterizer
from dav_gswt_study.stability.formula import Case, Check

SIDE = 24
PINHOLE = cameras.pinhole((0.3, -4.0, 1.5), (0.0, 0.0, 0.0), SIDE, SIDE, 60.0)
MAP = cameras.top_down(-2.0, -2.0, SIDE, SIDE, 4 / SIDE, 5.0)
AHEAD = Camera(np.eye(3), np.zeros(3), 20.0, 20.0, SIDE / 2, SIDE / 2, SIDE, SIDE)
VIEWS = (("pinhole", PINHOLE), ("map", MAP))
RIM = 1 / 255  # step of alpha where a splat ends
Arrays = dict[str, Array]
PARAMETERS = ("means", "log_scales", "quats", "opacity_logits", "colours")  # of Gaussians, in the oracle's order


def render(arrays: Arrays, camera: Camera, near: float = 0.01, antialiased: bool = False) -> Array:
    """Colour and alpha."""
    seen = make_rasterizer(near=near, antialiased=antialiased).forward(**arrays, camera=camera)
    return np.concatenate([seen.colour, seen.alpha[..., None]], -1)


def render_reference(arrays: Arrays, camera: Camera, near: float = 0.01, antialiased: bool = False) -> Array:
    import torch

    gaussians = {name: torch.tensor(arrays[name], dtype=torch.float64) for name in PARAMETERS}
    colour, alpha, _ = draw_by_oracle(gaussians, camera, near=near, antialiased=antialiased)
    return torch.cat([colour, alpha[..., None]], -1).numpy()


def in_all_views(at: str, arrays: Arrays) -> list[Case]:
    return [
        Case(f"{at}, {view}{', antialiased' * smooth}", (arrays, camera, 0.01, smooth))
        for view, camera in VIEWS
        for smooth in (False, True)
    ]


def scaled_cloud(*scales: float) -> Arrays:
    """A cloud of 40 Gaussians with these scales, of small opacity so that none hides the others."""
    return random_cloud(40, log_scales=np.tile(np.log(scales), (40, 1)), opacity_logits=np.full(40, -1.0))


def _cloud_cases() -> list[Case]:
    return in_all_views("a cloud of 200", random_cloud(200))


def _near_plane_cases() -> list[Case]:
    cases = []
    for near in (1e-3, 1.0, 10.0):
        for share in (-1.0, 0.0, 1e-8, 0.99, 1.0, 1.01):
            z = float(np.float32(near) * np.float32(share))
            one = random_cloud(
                1, means=[[0, 0, z]], log_scales=np.full((1, 3), np.log(0.1 * near)), opacity_logits=[1.0]
            )
            cases.append(Case(f"depth {share:g} of near {near:g}", (one, AHEAD, float(np.float32(near)), False)))
    return cases


def _scale_cases() -> list[Case]:
    return [
        p for s in (1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6) for p in in_all_views(f"scale {s:g}", scaled_cloud(s, s, s))
    ]


def _needle_cases() -> list[Case]:
    shapes = (1e3, 1e-3, 1e-3), (1.0, 1e-6, 1e-6), (1e6, 1.0, 1.0), (1e6, 1e-12, 1e-12)
    return [p for shape in shapes for p in in_all_views(f"needles {shape[0]:g} x {shape[1]:g}", scaled_cloud(*shape))]


def _opacity_cases() -> list[Case]:
    logits = (-1e4, -100.0, -5.55, 0.0, 4.5, 17.0, 100.0, 1e4)
    return [p for x in logits for p in in_all_views(f"logit {x:g}", random_cloud(60, opacity_logits=np.full(60, x)))]


def _gradient_cases() -> list[Case]:
    """Axes of different lengths: the rotation of a sphere has gradient 0, and errors relative to it mean nothing."""
    shapes = {f"scales about {s:g}": scaled_cloud(s, 0.5 * s, 2 * s) for s in (1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6)}
    shapes["a cloud"] = random_cloud(60)
    return [Case(f"{name}, {view}", (arrays, camera)) for name, arrays in shapes.items() for view, camera in VIEWS]


def _gradients(arrays: Arrays, camera: Camera) -> Array:
    raster = make_rasterizer()
    raster.forward(**arrays, camera=camera)
    cases = raster.backward(_output_gradient())
    return np.concatenate([_divide_by_norm(getattr(cases, name), arrays, camera, name) for name in arrays])


def _divide_by_norm(values: Array, arrays: Arrays, camera: Camera, name: str) -> Array:
    """Gradient of a parameter over its norm."""
    length = np.linalg.norm(_oracle_gradients(arrays, camera)[name])
    return np.ravel(values).astype(np.float64) / (length if length > 0 else 1.0)


def _gradients_reference(arrays: Arrays, camera: Camera) -> Array:
    return np.concatenate(
        [_divide_by_norm(g, arrays, camera, name) for name, g in _oracle_gradients(arrays, camera).items()]
    )


def _oracle_gradients(arrays: Arrays, camera: Camera) -> Arrays:
    import torch

    leaves = {name: torch.tensor(arrays[name], dtype=torch.float64, requires_grad=True) for name in PARAMETERS}
    colour, _, _ = draw_by_oracle(leaves, camera)
    loss = (colour * torch.from_numpy(_output_gradient()).double()).sum()
    gradients = torch.autograd.grad(loss, list(leaves.values()))
    return {name: g.numpy() for name, g in zip(PARAMETERS, gradients, strict=True)}


def _output_gradient() -> Array:
    return np.random.default_rng(1).standard_normal((SIDE, SIDE, 3)).astype(np.float32)


STEEP = 2e-2
AT_RIM = 3 * RIM
CHECKS = [
    Check("a usual picture", _cloud_cases, render, render_reference, absolute=2e-5),
    Check("near plane", _near_plane_cases, render, render_reference, absolute=2e-5),
    Check("scales", _scale_cases, render, render_reference, absolute=AT_RIM),
    Check("needles", _needle_cases, render, render_reference, absolute=STEEP),
    Check("opacity 0 and 1", _opacity_cases, render, render_reference, absolute=AT_RIM),
    Check("gradients, each over its length", _gradient_cases, _gradients, _gradients_reference, absolute=1e-3),
]
