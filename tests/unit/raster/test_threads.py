"""The number of threads changes no bit of anything."""

import numpy as np
import pytest
from raster_scenes import gaussians, image_gradients

from dav_gswt import cameras
from dav_gswt.raster import cpu

CAMERA = cameras.pinhole((0.3, -4, 1.5), (0, 0, 0), 150, 130, 60.0)
N = 20_000  # enough that the second thread is used: see cpu.TINY


def everything(isa: str, threads: int) -> list[np.ndarray]:
    raster = cpu.Rasterizer(instruction_set=isa, threads=threads)
    arrays = gaussians(N)
    arrays["log_scales"] -= 1.5
    seen = raster.forward(**arrays, camera=CAMERA)
    gradients = raster.backward(*image_gradients(CAMERA, 3))
    shares = raster.contributions(image_gradients(CAMERA, 3)[0])
    return [*vars(seen).values(), *vars(gradients).values(), *vars(shares).values()]


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_drawing_and_its_gradients(isa, threads):
    for a, b in zip(everything(isa, threads), everything(isa, 1), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("threads", [2, 5])
def test_loss_and_adam(threads):
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0, 1, (2, 110, 120, 3)).astype(np.float32)
    w = rng.uniform(0, 1, (110, 120)).astype(np.float32)
    alone, gradient = cpu.loss(x, y, w, threads=1)
    together, same = cpu.loss(x, y, w, threads=threads)
    assert alone == together
    np.testing.assert_array_equal(gradient, same)
    values = []
    for t in (1, threads):
        arrays = [x.copy(), np.zeros_like(x), np.zeros_like(x)]
        cpu.adam(arrays[0], gradient, *arrays[1:], rate=0.1, step=1, threads=t)
        values.append(arrays[0])
    np.testing.assert_array_equal(*values)


def test_memory_kept_from_a_larger_scene_leaves_no_trace(isa):
    fresh, used = cpu.Rasterizer(instruction_set=isa), cpu.Rasterizer(instruction_set=isa)
    used.forward(**gaussians(5000, seed=3, channels=7), camera=CAMERA)
    used.backward(np.ones((130, 150, 7), np.float32))
    small = gaussians(50, seed=4)
    for raster in (fresh, used):
        raster.forward(**small, camera=CAMERA)
    grad = image_gradients(CAMERA, 3)
    for a, b in zip(vars(used.backward(*grad)).values(), vars(fresh.backward(*grad)).values(), strict=True):
        np.testing.assert_array_equal(a, b)
