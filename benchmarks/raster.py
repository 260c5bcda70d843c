"""How long the rasterizer takes: forward and backward, by instruction set and number of threads."""

import os
import platform
import time
from functools import partial
from pathlib import Path

import numpy as np

from dav_gswt.cameras import Camera
from dav_gswt.raster import cpu

SCENES = [(256, 20_000), (256, 100_000), (512, 100_000)]  # pixels a side, Gaussians
THREADS = (1, 2)
REPEATS = 7


def scene(n: int, side: int) -> tuple[dict[str, np.ndarray], Camera]:
    """Gaussians like those of a trained field: in several layers before the camera, of log-normal sizes that shrink
    with their number so that some 40 lie over a pixel, of all opacities."""
    rng = np.random.default_rng(0)
    focal = 1.1 * side
    z = np.exp(rng.normal(np.log(4), 0.35, n)).clip(1.2, 12)
    u, v = rng.uniform(-0.05, 1.05, (2, n)) * side
    sigma = np.sqrt(25 * side**2 * 1.1**2 / (n * 2 * np.pi * 4))  # pixels
    arrays = {
        "means": np.stack([(u - side / 2) / focal * z, (v - side / 2) / focal * z, z], 1),
        "log_scales": np.log(sigma * z / focal)[:, None] + rng.normal(0, 0.5, (n, 3)),
        "quats": rng.normal(0, 1, (n, 4)),
        "opacity_logits": rng.normal(0, 2, n),
        "colours": rng.uniform(0, 1, (n, 3)),
    }
    camera = Camera(np.eye(3), np.zeros(3), focal, focal, side / 2, side / 2, side, side)
    return {k: np.ascontiguousarray(a, np.float32) for k, a in arrays.items()}, camera


def milliseconds(call) -> float:
    """The shortest of some calls: what it takes when nobody disturbs."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def processor() -> str:
    """The processor's name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def row(side: int, n: int, isa: str) -> list[float]:
    """Forward, backward and loss of one scene, for each number of threads."""
    arrays, camera = scene(n, side)
    gradient = np.random.default_rng(1).normal(size=(side, side, 3)).astype(np.float32)
    os.environ["DAV_GSWT_ISA"] = isa
    cells = []
    for threads in THREADS:
        raster = cpu.Rasterizer(threads=threads)
        cells.append(milliseconds(partial(raster.forward, **arrays, camera=camera)))
        cells.append(milliseconds(partial(raster.backward, gradient)))
        image = raster.forward(**arrays, camera=camera).colour
        cells.append(milliseconds(partial(cpu.loss, image, gradient, threads=threads)))
    return cells


def main() -> None:
    print(f"Rasterizer on {processor()}, {cpu.default_threads()} processors: shortest of {REPEATS} calls, milliseconds")
    columns = [f"{what}, {t} thread{'s' * (t > 1)}" for t in THREADS for what in ("forward", "backward", "loss")]
    print("| image | Gaussians | instructions | " + " | ".join(columns) + " |")
    print("|---" * (3 + len(columns)) + "|")
    for side, n in SCENES:
        for isa in cpu.instruction_sets():
            cells = " | ".join(f"{cell:.1f}" for cell in row(side, n, isa))
            print(f"| {side}x{side} | {n} | {isa} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
