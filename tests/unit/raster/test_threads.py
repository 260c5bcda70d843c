"""The number of threads changes no bit of anything."""

import numpy as np
import pytest
from fixtures.raster_scenes import gaussians, image_gradients

from dav_gswt.geometry import cameras
from dav_gswt.raster import cpu

CAMERA = cameras.pinhole((0.3, -4, 1.5), (0, 0, 0), 150, 130, 60.0)
N = 20_000  # enough that the second thread is used: see cpu.MIN_PARALLEL


def everything(isa: str, threads: int) -> list[np.ndarray]:
    raster = cpu.Rasterizer(instruction_set=isa, threads=threads)
    arrays = gaussians(N)
    arrays["log_scales"] -= 1.5
    seen = raster.forward(**arrays, camera=CAMERA)
    gradients = raster.backward(*image_gradients(CAMERA, 3))
    shares = raster.contributions(image_gradients(CAMERA, 3)[0])
    return [a for part in (seen, gradients, shares) for a in vars(part).values() if a is not None]


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_drawing_and_its_gradients(isa, threads):
    for a, b in zip(everything(isa, threads), everything(isa, 1), strict=True):
        np.testing.assert_array_equal(a, b)


def a_ground_mostly_outside(isa: str, threads: int) -> list[np.ndarray]:
    """With harmonics, features, antialiased; most of it beside the picture and before the near plane."""
    arrays = gaussians(N)
    arrays["means"] *= 6
    arrays["log_scales"] -= 1
    rng = np.random.default_rng(3)
    arrays["colours"], extra = (rng.normal(size=(N, *s)).astype(np.float32) for s in ((9, 3), (5,)))
    raster = cpu.Rasterizer(antialiased=True, instruction_set=isa, threads=threads)
    seen = raster.forward(**arrays, camera=CAMERA, features=extra)
    gradients = raster.backward(*image_gradients(CAMERA, 3), image_gradients(CAMERA, 5, seed=2)[0])
    assert 100 < raster.visible.sum() < N // 2
    return [*vars(seen).values(), *vars(gradients).values(), raster.visible, np.array(raster.count_pairs())]


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_harmonics_features_and_the_camera(isa, threads):
    for a, b in zip(a_ground_mostly_outside(isa, threads), a_ground_mostly_outside(isa, 1), strict=True):
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
    bent = gaussians(4000, seed=5) | {"colours": np.ones((4000, 16, 3), np.float32)}
    used.forward(**bent, camera=CAMERA, features=np.ones((4000, 2), np.float32))
    used.backward(np.ones((130, 150, 3), np.float32))
    small = gaussians(50, seed=4)
    for raster in (fresh, used):
        raster.forward(**small, camera=CAMERA)
    grad = image_gradients(CAMERA, 3)
    found, wanted = used.backward(*grad), fresh.backward(*grad)
    for name in ("means", "log_scales", "quats", "opacity_logits", "colours", "camera"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
