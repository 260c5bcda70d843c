"""The rasterizer on an NVIDIA GPU beside the core on all cores: a call with its copies, and gsplat's kernels alone.

Needs the extra `cuda`; without a GPU it says so. Prints a table, asserts nothing.
"""

import os
import statistics
import time

import numpy as np
from raster import Scene, made
from record import report_figures

from dav_gswt.raster import adam, backends, loss

SCENES = [
    Scene("512_100k", 512, 512, 100_000),
    Scene("1024_500k", 1024, 768, 500_000),
    Scene("1080p_1m", 1920, 1080, 1_000_000),
    Scene("1080p_3m", 1920, 1080, 3_000_000),
]
WARM_UP, REPEATS = 2, 5


def main() -> None:
    if why := backends.explain_unavailable("cuda"):
        print(f"gpu: nothing measured: {why}")
        return
    import torch

    print(f"{torch.cuda.get_device_name()}, {os.cpu_count()} cores")
    figures: dict[str, float | None] = {}
    print("| scene | kernels forward | backward | cuda forward | backward | loss | Adam | cpu forward | backward |")
    print("|---" * 9 + "|")
    for scene in SCENES:
        values = [*time_kernels(scene), *time_backend("cuda", scene)]
        values += time_backend("cpu", scene)[:2] if not backends.explain_unavailable("cpu") else [float("nan")] * 2
        print(f"| {scene.name} | " + " | ".join(f"{value:.2f}" for value in values) + " |", flush=True)
        figures[f"cuda_{scene.name}_ms"] = sum(values[2:4])
        figures[f"cuda_{scene.name}_over_cpu"] = sum(values[2:4]) / sum(values[6:8])
    report_figures(figures, {})


def time_backend(name: str, scene: Scene) -> list[float]:
    """Milliseconds of forward, backward, loss, and Adam's step for all parameters, arrays copied to and fro."""
    backend = backends.load_backend(name)
    arrays, camera = made(scene.width, scene.height, scene.gaussians, (4, 3))
    drawn = backend.Rasterizer()
    seen = drawn.forward(**arrays, camera=camera)
    gradient = np.random.default_rng(1).normal(size=seen.colour.shape).astype(np.float32)
    found = vars(drawn.backward(gradient))
    moments = {key: (np.zeros_like(a), np.zeros_like(a)) for key, a in arrays.items()}
    target = np.clip(seen.colour + 0.05 * gradient, 0, 1)

    def step() -> None:
        for key, values in arrays.items():
            adam(values, found[key], *moments[key], rate=1e-9, step=1, rows=drawn.visible, backend=name)

    calls = [
        lambda: drawn.forward(**arrays, camera=camera),
        lambda: drawn.backward(gradient),
        lambda: loss(seen.colour, target, backend=name),
        step,
    ]
    return [milliseconds(call) for call in calls]


def time_kernels(scene: Scene) -> list[float]:
    """Milliseconds of gsplat's own forward and backward passes, everything on the GPU."""
    import torch

    arrays, camera = made(scene.width, scene.height, scene.gaussians, (4, 3))
    drawn = backends.load_backend("cuda").Rasterizer()
    leaves = {key: torch.tensor(a, device="cuda").requires_grad_() for key, a in arrays.items()}
    view = torch.eye(4, device="cuda").requires_grad_()

    def forward() -> torch.Tensor:
        picture = drawn._call_gsplat(leaves, view, camera)[0]
        torch.cuda.synchronize()
        return picture

    shown = forward()
    gradient = torch.randn_like(shown)

    def backward() -> None:
        torch.autograd.grad(shown, (*leaves.values(), view), gradient, retain_graph=True)
        torch.cuda.synchronize()

    return [milliseconds(forward), milliseconds(backward)]


def milliseconds(call) -> float:
    """The median of some calls after a few."""
    times = []
    for _ in range(WARM_UP + REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * statistics.median(times[WARM_UP:])


if __name__ == "__main__":
    main()
