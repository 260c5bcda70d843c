"""What is not seen may be anything, memory that is kept leaves no trace, and the number of threads changes no bit."""

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, gaussians, image_gradients

from dav_gswt.raster import adam, cpu, loss

CAMERA = CAMERAS["pinhole"]


def test_values_that_are_not_finite_far_outside_are_no_reason_to_stop(raster):
    arrays = gaussians(50)
    arrays["means"][7] += 1e4
    arrays["colours"][7] = np.nan
    assert np.isfinite(raster.forward(**arrays, camera=CAMERA).colour).all()
    arrays["means"][7, 1] = np.nan
    with pytest.raises(ValueError, match="means of Gaussian 7 is not finite"):
        raster.forward(**arrays, camera=CAMERA)


def test_memory_kept_from_a_larger_scene_leaves_no_trace(isa):
    fresh, used = cpu.Rasterizer(instruction_set=isa), cpu.Rasterizer(instruction_set=isa)
    used.forward(**gaussians(600, seed=3, channels=7), camera=CAMERA)
    used.backward(np.ones((52, 70, 7), np.float32))
    bent = gaussians(500, seed=5) | {"colours": np.ones((500, 16, 3), np.float32)}
    used.forward(**bent, camera=CAMERA)
    used.backward(np.ones((52, 70, 3), np.float32))
    small = gaussians(50, seed=4)
    for raster in (fresh, used):
        raster.forward(**small, camera=CAMERA)
    grad = image_gradients(CAMERA, 3)
    found, wanted = used.backward(*grad), fresh.backward(*grad)
    for name in ("means", "log_scales", "quats", "opacity_logits", "colours"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))


# --- threads


def a_cloud(isa: str, threads: int) -> list[np.ndarray]:
    raster = cpu.Rasterizer(instruction_set=isa, threads=threads)
    seen = raster.forward(**gaussians(2000), camera=CAMERA)
    gradients = raster.backward(*image_gradients(CAMERA, 3))
    shares = raster.contributions(image_gradients(CAMERA, 3)[0])
    return [a for part in (seen, gradients, shares) for a in vars(part).values() if a is not None]


def a_ground_mostly_outside(isa: str, threads: int) -> list[np.ndarray]:
    """With harmonics, antialiased; most of it beside the picture and before the near plane."""
    n, rng = 3000, np.random.default_rng(3)
    arrays = gaussians(n)
    arrays["means"] *= 6
    arrays["colours"] = rng.normal(size=(n, 9, 3)).astype(np.float32)
    raster = cpu.Rasterizer(antialiased=True, instruction_set=isa, threads=threads)
    seen = raster.forward(**arrays, camera=CAMERA)
    gradients = raster.backward(*image_gradients(CAMERA, 3))
    assert 100 < raster.visible.sum() < n // 2
    return [
        *vars(seen).values(),
        *vars(gradients).values(),
        raster.visible,
        np.array(raster._core.pairs(raster._last.state)),
    ]


def loss_and_adam(isa: str, threads: int) -> list[np.ndarray]:
    x, y = np.random.default_rng(0).uniform(0, 1, (2, 40, 120, 3)).astype(np.float32)
    value, gradient = loss(x, y, y[..., 0].copy(), threads=threads, backend="cpu")
    moved = x.reshape(-1, 3).copy()
    moments = np.zeros_like(moved), np.zeros_like(moved)
    adam(moved, gradient.reshape(-1, 3), *moments, 0.1, 1, threads=threads, backend="cpu")
    return [np.array(value), gradient, moved]


@pytest.mark.parametrize("work", [a_cloud, a_ground_mostly_outside, loss_and_adam])
def test_the_number_of_threads_changes_no_bit(isa, work, monkeypatch):
    monkeypatch.setenv("DAV_GSWT_ISA", isa)
    monkeypatch.setattr(cpu, "MIN_PARALLEL", 0)  # small work too is shared out
    for a, b in zip(work(isa, 3), work(isa, 1), strict=True):
        np.testing.assert_array_equal(a, b)
