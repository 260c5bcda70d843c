"""How long the rasterizer takes, how near that is to what the processor can do, and how much memory it needs."""

import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from record import merge_figures

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import _core, adam, cpu, loss
from dav_gswt.threads import default_threads

# Floating-point operations of a pixel and a Gaussian that is blended into it, a fused multiply-add counted as two.
FLOPS_OF_A_PAIR = (25 + 8) + (25 + 7 + 8 + 11 + 6)  # forward, backward
REPEATS = 15
THREADS = 2  # of the figures; the table has one thread too
SH1 = 4  # coefficients of spherical harmonics of degree 1


@dataclass(frozen=True)
class Scene:
    """limit: the target in milliseconds, forward and backward together."""

    name: str
    width: int
    height: int
    gaussians: int
    limit: float | None = None


SCENES = [
    Scene("raster_256_20k_ms", 256, 256, 20_000, 10),
    Scene("raster_512_100k_ms", 512, 512, 100_000, 50),
    Scene("raster_1024_100k_ms", 1024, 768, 100_000, 75),
    Scene("raster_1024_500k_ms", 1024, 768, 500_000),
]
SHARE_OF = SCENES[1]  # the scene of raster_fma_share and of the table
LIVE = 40, 55  # splats that a pixel of any scene takes


def made(width: int, height: int, n: int, channels: tuple[int, ...] = (3,)) -> tuple[dict[str, np.ndarray], Camera]:
    """Gaussians like those of a trained field: in several layers before the camera, of log-normal sizes that shrink
    with their number so that a pixel takes LIVE of them whatever the picture's size, of all opacities."""
    rng = np.random.default_rng(0)
    focal = 1.1 * width
    z = np.exp(rng.normal(np.log(4), 0.35, n)).clip(1.2, 12)
    u, v = (rng.uniform(-0.05, 1.05, n) * side for side in (width, height))
    sigma = np.sqrt(32 * width * height * 1.1**2 / (n * 2 * np.pi * 4) - 0.3)  # pixels, before the dilation
    arrays = {
        "means": np.stack([(u - width / 2) / focal * z, (v - height / 2) / focal * z, z], 1),
        "log_scales": np.log(sigma * z / focal)[:, None] + rng.normal(0, 0.5, (n, 3)),
        "quats": rng.normal(0, 1, (n, 4)),
        "opacity_logits": rng.normal(0, 2, n),
        "colours": rng.uniform(0, 1, (n, *channels)),
    }
    camera = Camera(np.eye(3), np.zeros(3), focal, focal, width / 2, height / 2, width, height)
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


def drawing(scene: Scene, isa: str, threads: int) -> tuple[float, float, int]:
    """Milliseconds of forward and of backward, and pairs of a pixel and a splat that it takes."""
    arrays, camera = made(scene.width, scene.height, scene.gaussians)
    gradient = np.random.default_rng(1).normal(size=(scene.height, scene.width, 3)).astype(np.float32)
    raster = cpu.Rasterizer(threads=threads, instruction_set=isa)
    forward = milliseconds(lambda: raster.forward(**arrays, camera=camera))
    return forward, milliseconds(lambda: raster.backward(gradient)), raster._core.pairs(raster._last.state)


def share(pairs: int, milliseconds: float, isa: str, threads: int) -> tuple[float, float]:
    """What the processor does at most (fused multiply-adds of floats a second), and the share of it that the blending
    of `pairs` is; projection, sorting and sums are in the time, but not in the share."""
    peak = _core.peak(isa, 0.3, threads)
    return peak, pairs * FLOPS_OF_A_PAIR / (2 * peak) / (milliseconds / 1e3)


def table() -> None:
    """One scene by instruction set and number of threads, beside what the processor does at most."""
    print(f"{SHARE_OF.width} x {SHARE_OF.height} pixels, {SHARE_OF.gaussians} Gaussians")
    print(
        "| instructions | threads | forward, ms | backward, ms | live pairs, G/s | FMA peak, G/s | share of the peak |"
    )
    print("|---" * 7 + "|")
    for isa in cpu.instruction_sets():
        for threads in (1, 2):
            forward, backward, pairs = drawing(SHARE_OF, isa, threads)
            peak, part = share(pairs, forward + backward, isa, threads)
            rate = pairs / (forward + backward) / 1e6
            print(
                f"| {isa} | {threads} | {forward:.1f} | {backward:.1f} | {rate:.2f} | {peak / 1e9:.0f} | {part:.3f} |",
                flush=True,
            )


def scenes() -> dict[str, float]:
    """Forward and backward of all scenes, and the share of the peak of one."""
    isa, figures = cpu.instruction_sets()[0], {}
    for scene in SCENES:
        forward, backward, pairs = drawing(scene, isa, THREADS)
        live = pairs / (scene.width * scene.height)
        figures[scene.name] = forward + backward
        report_figures(scene.name, forward + backward, "ms", scene.limit, f"{live:.0f} live Gaussians a pixel")
        if not LIVE[0] <= live <= LIVE[1]:
            raise ValueError(f"{scene.name}: {live:.1f} live Gaussians a pixel are not {LIVE[0]} to {LIVE[1]}")
        if scene is SHARE_OF:
            peak, part = share(pairs, forward + backward, isa, THREADS)
            figures["raster_fma_share"] = part
            rate = pairs / (forward + backward) / 1e6
            report_figures(
                "raster_fma_share", part, "", None, f"{rate:.2f} of {peak / 1e9:.0f} G/s: live pairs, FMA peak"
            )
    return figures


def training_step() -> dict[str, float]:
    """Forward, loss, backward and Adam on all arrays; spherical harmonics of degree 1."""
    arrays, camera = made(256, 192, 30_000, (SH1, 3))
    raster = cpu.Rasterizer(threads=THREADS)
    target = np.random.default_rng(1).uniform(0, 1, (192, 256, 3)).astype(np.float32)
    moments = {name: (np.zeros_like(a), np.zeros_like(a)) for name, a in arrays.items()}

    def step():
        seen = raster.forward(**arrays, camera=camera)
        _, by_colour = loss(seen.colour, target, threads=THREADS, backend="cpu")
        gradients = raster.backward(by_colour)
        for name, values in arrays.items():  # a rate so small that all steps see the same scene
            given = values, getattr(gradients, name), *moments[name]
            adam(*given, rate=1e-9, step=1, threads=THREADS, backend="cpu")

    name, took = "train_step_256x192_30k_ms", milliseconds(step)
    pairs = raster._core.pairs(raster._last.state)
    report_figures(name, took, "ms", 15, f"{pairs / (256 * 192):.0f} live Gaussians a pixel")
    return {name: took}


def memory() -> dict[str, float]:
    """Most memory of a process, its Gaussians and all of Python included, that draws a million and takes them back."""
    done = subprocess.run([sys.executable, __file__, "--memory"], capture_output=True, text=True, check=True)
    name, megabytes = "raster_1m_memory_mb", float(done.stdout)
    report_figures(name, megabytes, "MB", 1000)
    return {name: megabytes}


def peak_of_a_million() -> float:
    """Megabytes; in a process of its own. The peak counts from when the scene is there: making it takes more."""
    import resource

    arrays, camera = made(1024, 768, 1_000_000)
    fresh = Path("/proc/self/clear_refs")
    if fresh.exists():
        fresh.write_text("5")  # the peak so far is forgotten
    raster = cpu.Rasterizer(threads=THREADS)
    gradients = raster.backward(raster.forward(**arrays, camera=camera).colour)
    assert gradients.means.any()
    status = Path("/proc/self/status")
    if status.exists():
        return next(float(s.split()[1]) for s in status.read_text().splitlines() if s.startswith("VmHWM")) * 1024 / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def report_figures(name: str, value: float, unit: str, limit: float | None = None, more: str = "") -> None:
    remarks = ([] if limit is None else [f"target {limit:g}"]) + ([more] if more else [])
    print(f"{name}: {value:.4g} {unit}".rstrip() + (f" ({'; '.join(remarks)})" if remarks else ""), flush=True)


def main() -> None:
    print(f"Rasterizer on {processor()}, {default_threads()} processors: shortest of {REPEATS} calls")
    table()
    print(f"{cpu.instruction_sets()[0]}, {THREADS} threads; forward and backward together:")
    merge_figures(scenes() | training_step() | memory())


if __name__ == "__main__":
    if "--memory" in sys.argv:
        print(peak_of_a_million())
    else:
        main()
