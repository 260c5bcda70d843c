"""Forward and backward of the rasterizer: milliseconds per instruction set and thread count, the best of several runs."""

import os
import platform
import time

import numpy as np

from dav_gswt import cameras
from dav_gswt.raster import _core, cpu


def scene(n: int, side: int):
    """Gaussians in front of a camera, in several layers, sized so that about 40 are drawn at a pixel."""
    rng = np.random.default_rng(0)
    focal = 1.1 * side
    z = np.exp(rng.normal(np.log(4), 0.35, n)).clip(1.2, 12)
    u, v = rng.uniform(-0.05, 1.05, (2, n)) * side
    sigma = np.sqrt(25 * side * side * 1.21 / (n * 8 * np.pi))
    means = np.stack([(u - side / 2) / focal * z, (v - side / 2) / focal * z, z], 1)
    values = (
        means,
        np.log(sigma * z / focal)[:, None] + rng.normal(0, 0.5, (n, 3)),
        rng.normal(size=(n, 4)),
        rng.normal(0, 2, n),
        rng.uniform(0, 1, (n, 3)),
    )
    camera = cameras.Camera(np.eye(3), np.zeros(3), focal, focal, side / 2, side / 2, side, side)
    return [np.ascontiguousarray(a, np.float32) for a in values], camera


def best(call, runs: int = 7) -> float:
    """Milliseconds of the fastest of several runs: what the machine can do, whatever else it does."""
    took = []
    for _ in range(runs):
        start = time.perf_counter()
        call()
        took.append(time.perf_counter() - start)
    return 1e3 * min(took)


def main() -> None:
    print(f"rasterizer on {platform.processor() or platform.machine()}, {len(os.sched_getaffinity(0))} processors")
    print(f"{'set':8} {'threads':>7} {'image':>6} {'Gaussians':>9} {'forward ms':>11} {'backward ms':>12}")
    for name in _core.instruction_sets():
        for threads in (1, 2):
            for side, n in ((256, 20_000), (256, 100_000), (512, 100_000)):
                os.environ |= {"DAV_GSWT_ISA": name, "DAV_GSWT_THREADS": str(threads)}
                values, camera = scene(n, side)
                raster = cpu.Rasterizer()
                by = np.ones((side, side, 3), np.float32)
                forward = best(lambda: raster.forward(*values, camera))
                backward = best(lambda: raster.backward(by))
                print(f"{name:8} {threads:7} {side:6} {n:9} {forward:11.1f} {backward:12.1f}")


if __name__ == "__main__":
    main()
