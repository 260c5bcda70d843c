"""A fit as gsplat's users run it, to compare ours with: its strategy, its published rates, on an NVIDIA GPU.

As its trainer for captured scenes: Gaussians at the points of structure from motion, as large as these are apart, of
opacity .1; Adam with the rates of the 3DGS paper, that of centres falling to a hundredth; a harmonic's degree more
every 1000 steps; .8 L1 + .2 (1 - SSIM); growth, splitting and pruning by `DefaultStrategy`. Photos and what is worked
with stay on the GPU. Needs the extra `cuda`.
"""

import time

import gsplat  # pyright: ignore[reportMissingImports]  an extra
import numpy as np
import torch
from jaxtyping import Float, Float32
from kornia.metrics import ssim
from numpy import ndarray as Array
from scipy.spatial import cKDTree
from torch import Tensor

from dav_gswt.field import SH0
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.training_views import TrainingView
from dav_gswt_study.fit_profile import PhotoSet, measure_quality

RATES = {"means": 1.6e-4, "scales": 5e-3, "quats": 1e-3, "opacities": 5e-2, "sh0": 2.5e-3, "shN": 2.5e-3 / 20}
SH_DEGREE, SH_EVERY = 3, 1000  # steps
OPACITY = 0.1  # at the start
STRUCTURE = 0.2  # weight of 1 - SSIM
WINDOW = 11  # pixels of SSIM's window, a Gaussian of sigma 1.5


def profile_gsplat(photos: PhotoSet, steps: int, every: int, seed: int = 0, device: str = "cuda") -> list[dict]:
    """Train on the training photos, looking at the test views every so many steps.

    Returns: rows as of `fit_profile.profile_fit`. Time spent on measuring is not counted.
    """
    torch.manual_seed(seed)
    measuring, curve = 0.0, []
    start = time.perf_counter()
    centres = np.array([view.camera.centre for view in photos.train])
    size = float(1.1 * np.linalg.norm(centres - centres.mean(0), axis=1).max())
    given = {name: torch.nn.Parameter(a.to(device)) for name, a in _start(photos).items()}
    adams = {
        name: torch.optim.Adam([value], RATES[name] * (size if name == "means" else 1), eps=1e-15)
        for name, value in given.items()
    }
    falling = torch.optim.lr_scheduler.ExponentialLR(adams["means"], gamma=0.01 ** (1 / steps))
    strategy = gsplat.DefaultStrategy()
    state = strategy.initialize_state(scene_scale=size)
    views = [_to_device(view, device) for view in photos.train]
    rng = np.random.default_rng(seed)
    for step in range(steps):
        camera, target = views[rng.integers(len(views))]
        degree = min(step // SH_EVERY, SH_DEGREE)
        seen, info = draw(given, camera, degree)
        strategy.step_pre_backward(given, adams, state, step, info)
        compute_loss(seen, target).backward()
        for adam in adams.values():
            adam.step()
            adam.zero_grad(set_to_none=True)
        falling.step()
        strategy.step_post_backward(given, adams, state, step, info, packed=False)
        if (step + 1) % every == 0 or step + 1 == steps:
            torch.cuda.synchronize()
            begun = time.perf_counter()
            row = {"seconds": begun - start - measuring, "step": step + 1, "gaussians": len(given["means"])}
            curve.append(row | measure_quality(lambda v, degree=degree: _show(given, v.camera, degree), photos.tests))
            measuring += time.perf_counter() - begun
    return curve


def draw(
    given: dict[str, torch.nn.Parameter], camera: Camera, degree: int
) -> tuple[Float[Tensor, "h w 3"], dict[str, Tensor]]:
    """The picture over black, and gsplat's intermediate results."""
    device = given["means"].device
    view = torch.eye(4, device=device)
    view[:3, :3] = torch.as_tensor(np.asarray(camera.rotation))
    view[:3, 3] = torch.as_tensor(np.asarray(camera.translation))
    inner = torch.tensor([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]], device=device)
    seen, _, info = gsplat.rasterization(
        given["means"],
        given["quats"],
        given["scales"].exp(),
        given["opacities"].sigmoid(),
        torch.cat([given["sh0"], given["shN"]], 1),
        view[None],
        inner[None].float(),
        camera.width,
        camera.height,
        sh_degree=degree,
        packed=False,
    )
    return seen[0], info


def compute_loss(seen: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"]) -> Float[Tensor, ""]:
    """(1 - structure) L1 + structure (1 - SSIM), without the borders that SSIM's window does not fill."""
    x, y = (image.permute(2, 0, 1)[None] for image in (seen, target))
    similar = ssim(x, y, WINDOW, padding="valid").mean()
    return (1 - STRUCTURE) * (x - y).abs().mean() + STRUCTURE * (1 - similar)


def _start(photos: PhotoSet) -> dict[str, Float32[Tensor, "n ..."]]:
    """The Gaussians before the first step."""
    points = torch.tensor(photos.model.points, dtype=torch.float32)
    n = len(points)
    apart = np.asarray(cKDTree(photos.model.points).query(photos.model.points, k=4)[0])[:, 1:]
    scale = torch.tensor(np.log(np.sqrt((apart**2).mean(1)).clip(1e-7)), dtype=torch.float32)
    colours = torch.tensor(photos.model.colours, dtype=torch.float32)
    return {
        "means": points,
        "scales": scale[:, None].repeat(1, 3),
        "quats": torch.rand(n, 4),
        "opacities": torch.logit(torch.full((n,), OPACITY)),
        "sh0": ((colours - 0.5) / SH0)[:, None],
        "shN": torch.zeros(n, (SH_DEGREE + 1) ** 2 - 1, 3),
    }


def _to_device(view: TrainingView, device: str) -> tuple[Camera, Tensor]:
    return view.camera, torch.tensor(view.image, device=device)


def _show(given: dict[str, torch.nn.Parameter], camera: Camera, degree: int) -> Float32[Array, "h w 3"]:
    with torch.no_grad():
        return draw(given, camera, degree)[0].cpu().numpy()
