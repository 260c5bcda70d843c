"""The antialiased mode: what is smaller than a pixel fades instead of growing."""

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, gaussians, image_gradients, map_camera, one, oracle_answers, relative

from dav_gswt.raster import cpu


@pytest.fixture
def raster(isa):
    return cpu.Rasterizer(antialiased=True, instruction_set=isa)


def test_a_splats_peak_is_its_opacity_times_the_root_of_both_determinants(raster):
    # variance 1 without, 1.3 with the dilation, in both directions: sqrt(1 / 1.69)
    seen = raster.forward(**one(), camera=map_camera())
    assert seen.alpha[8, 8] == pytest.approx(0.5 / 1.3, rel=1e-5)
    assert seen.alpha[8, 9] == pytest.approx(0.5 / 1.3 * np.exp(-0.5 / 1.3), rel=1e-5)


def test_the_light_of_a_small_splat_grows_with_its_area(raster, isa):
    # sum of o' exp(-d^2 / 2S) over pixels: 2 pi o sqrt(det S0), 1/255 cut off; plain: 2 pi o sqrt(det S), whatever S0
    light, plain = [], []
    for scale in (0.03, 0.06):
        arrays = one(scale=scale, opacity=0.99)
        light.append(raster.forward(**arrays, camera=map_camera()).alpha.sum())
        plain.append(cpu.Rasterizer(instruction_set=isa).forward(**arrays, camera=map_camera()).alpha.sum())
    assert light[0] == pytest.approx(2 * np.pi * 0.99 * 0.3**2, rel=0.1)  # tails below 1/255; few pixels
    assert light[1] / light[0] == pytest.approx(4, rel=0.1)
    assert plain[1] / plain[0] < 2.2


def test_the_gradients_of_one_pixel_are_those_worked_by_hand(raster):
    # at the centre alpha = o sqrt(sx0 / sx) sqrt(sy0 / sy) with sx0 = (10 scale_x)^2 = 1, sx = sx0 + .3, so that
    # dalpha / dlog scale_x = alpha (1 - sx0 / sx)
    raster.forward(**one(), camera=map_camera())
    grad = np.zeros((16, 16, 3), np.float32)
    grad[8, 8, 0] = 1
    found, alpha = raster.backward(grad), 0.5 / 1.3
    np.testing.assert_allclose(found.log_scales[0], [alpha * 0.3 / 1.3, alpha * 0.3 / 1.3, 0], rtol=1e-4, atol=1e-6)
    assert found.opacity_logits[0] == pytest.approx(alpha * 0.5, rel=1e-5)


def test_without_dilation_both_modes_are_the_same(isa):
    arrays, camera = gaussians(200), CAMERAS["pinhole"]
    results = []
    for antialiased in (False, True):
        raster = cpu.Rasterizer(dilation=0.0, antialiased=antialiased, instruction_set=isa)
        seen = raster.forward(**arrays, camera=camera)
        results.append((seen, raster.backward(*image_gradients(camera, 3))))
    np.testing.assert_allclose(results[0][0].colour, results[1][0].colour, atol=1e-6)
    for name in ("means", "log_scales", "quats", "opacity_logits", "colours"):
        assert relative(getattr(results[1][1], name), getattr(results[0][1], name)) < 1e-6, name


@pytest.mark.parametrize("scales", [(1e-12, 1e-12, 1e-12), (1.0, 1e-12, 1e-12), (1e-30, 1e-30, 1e-30)])
def test_what_has_no_area_is_nowhere(raster, scales):
    seen = raster.forward(**one(scale=scales, opacity=0.99), camera=map_camera())
    assert not seen.alpha.any() and not raster.visible.any()
    found = raster.backward(np.ones((16, 16, 3), np.float32))
    assert not any(np.any(g) for g in vars(found).values() if g is not None)


@pytest.mark.parametrize("view", CAMERAS)
@pytest.mark.parametrize("scale", [0.003, 0.03, 30.0, 1e6])
def test_sizes_far_apart_are_the_oracles(raster, view, scale):
    arrays, camera = gaussians(120), CAMERAS[view]
    arrays["log_scales"] += np.float32(np.log(scale)) - arrays["log_scales"].mean()
    gradients = image_gradients(camera, 3)
    (colour, alpha, _), wanted = oracle_answers(arrays, camera, gradients, antialiased=True)
    seen = raster.forward(**arrays, camera=camera)
    np.testing.assert_allclose(seen.colour, colour, atol=1e-5)
    np.testing.assert_allclose(seen.alpha, alpha, atol=1e-5)
    found = raster.backward(*gradients)
    # splats far larger than the picture are flat on it: gradients by their shape are differences of next to nothing
    for name in ("colours", "opacity_logits", "log_scales") if scale < 1 else ("colours", "opacity_logits"):
        assert relative(getattr(found, name), wanted[name]) < 1e-4, name
