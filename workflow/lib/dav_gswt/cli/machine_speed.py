"""How fast this machine is now, against the one on which the seconds of `estimate` were measured."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# seconds of one repetition on the reference machine (two idle cores of an AMD EPYC, C++ core): the least of many
RASTER_SECONDS, GENERAL_SECONDS = 3.4e-3, 2.3e-3
DURATION = 0.7  # seconds that each of the two is repeated for: enough to notice that others work on the machine
GAUSSIANS, PIXELS = 20_000, 192  # of the picture that is rendered and differentiated


@dataclass(frozen=True)
class MachineSpeed:
    """How many times as long as on the reference machine things take: the rasterizer, and all other work."""

    raster: float = 1.0
    general: float = 1.0


def measure_speed(cores: int) -> MachineSpeed:
    """Render and differentiate a small picture, and sort and transform a small array, again and again.

    cores: that the run may use; a job uses two of them at most.
    """
    threads = min(2, cores)
    return MachineSpeed(
        _time_repetition(_make_raster_work(threads), threads) / RASTER_SECONDS,
        _time_repetition(_make_general_work(), threads) / GENERAL_SECONDS,
    )


def share_cores(threads: int, others: float, cores: int) -> float:
    """How many times as long a job of so many threads takes beside others that work on the same cores."""
    return max(1.0, (min(threads, cores) + others) / cores)


def _time_repetition(work: Callable[[], object], threads: int) -> float:
    """Seconds of a repetition in a long job: the mean, or the median and its share of the cores where that is more.

    A program that has just begun goes before those that have worked for long, so the mean alone is too good.
    """
    work()
    end, seconds, others = time.perf_counter() + DURATION, [], []
    while not seconds or time.perf_counter() < end:
        begun = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begun)
        others.append(max(0.0, _count_working_threads() - 1))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    shared = float(np.median(seconds)) * share_cores(threads, float(np.mean(others)), cores)
    return max(float(np.mean(seconds)), shared)


def _count_working_threads() -> float:
    """Threads that run or wait for a core now, this one included; where the system does not say it, this one alone."""
    try:
        return float(Path("/proc/loadavg").read_text(encoding="ascii").split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return 1.0


def _make_raster_work(threads: int) -> Callable[[], object]:
    from dav_gswt.geometry import camera_layouts
    from dav_gswt.raster import make_rasterizer

    rng = np.random.default_rng(0)
    places = [rng.uniform(-3, 3, (GAUSSIANS, 2)), rng.uniform(0, 0.2, (GAUSSIANS, 1))]
    arrays = {
        "means": np.concatenate(places, 1).astype(np.float32),
        "log_scales": np.full((GAUSSIANS, 3), np.log(0.03), np.float32),
        "quats": np.tile(np.array([1, 0, 0, 0], np.float32), (GAUSSIANS, 1)),
        "opacity_logits": np.ones(GAUSSIANS, np.float32),
        "colours": rng.random((GAUSSIANS, 3)).astype(np.float32),
    }
    camera = camera_layouts.orbit(60.0, 0.0, 7.0, np.zeros(3), PIXELS, PIXELS, 55.0)
    rasterizer, gradient = make_rasterizer(threads=threads), np.ones((PIXELS, PIXELS, 3), np.float32)

    def work() -> None:
        rasterizer.forward(**arrays, camera=camera)
        rasterizer.backward(gradient)

    return work


def _make_general_work() -> Callable[[], object]:
    values = np.random.default_rng(0).normal(size=(256, 256)).astype(np.float32)

    def work() -> None:
        np.fft.fft2(values)
        np.sort(values, axis=None)
        values.cumsum(0)
        sorted(range(5000), key=lambda value: -value)

    return work
