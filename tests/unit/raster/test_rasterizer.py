"""What one splat looks like, what may not matter, and the extremes."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, NAMES, gaussians, image_gradients, map_camera, one, taken, together

from dav_gswt.raster import cpu, interface


def parts(answer) -> list[np.ndarray]:
    """The arrays of a rendering or of gradients that are there."""
    return [a for a in vars(answer).values() if a is not None]


def assert_same_bits(found, wanted):
    for a, b in zip(parts(found), parts(wanted), strict=True):
        np.testing.assert_array_equal(a, b)


# --- hand-worked values


def test_one_splat_from_above_is_a_gaussian_of_its_variance_plus_the_dilation(raster):
    # scale 0.1 at 10 pixels a unit: variance 1 + 0.3
    seen = raster.forward(**one(), camera=map_camera())
    assert seen.alpha[8, 8] == pytest.approx(0.5, abs=1e-6)
    assert seen.alpha[8, 9] == pytest.approx(0.5 * np.exp(-0.5 / 1.3), rel=1e-5)
    assert seen.alpha[10, 9] == pytest.approx(0.5 * np.exp(-0.5 * 5 / 1.3), rel=1e-5)
    np.testing.assert_allclose(seen.colour[8, 8], [0.5, 0.25, 0.125], rtol=1e-5)
    assert seen.depth[8, 8] == pytest.approx(0.5 * 2.0, rel=1e-5)


def test_gradients_of_one_pixel_are_those_worked_by_hand(raster):
    # L = red of the pixel one to the right of the centre; alpha = o exp(-dx^2 / 2s) with s = 1.3, dx = 1
    raster.forward(**one(), camera=map_camera())
    grad = np.zeros((16, 16, 3), np.float32)
    grad[8, 9, 0] = 1
    found = raster.backward(grad)
    alpha = 0.5 * np.exp(-0.5 / 1.3)
    np.testing.assert_allclose(found.colours[0], [alpha, 0, 0], rtol=1e-5)
    assert found.opacity_logits[0] == pytest.approx(alpha * 0.5, rel=1e-5)
    np.testing.assert_allclose(found.means[0], [alpha / 1.3 * 10, 0, 0], rtol=1e-4, atol=1e-5)
    # ds_xx / dlog_scale_x = 2 (10 scale)^2 = 2, dalpha/ds = alpha dx^2 / (2 s^2)
    np.testing.assert_allclose(found.log_scales[0], [alpha / 1.3**2, 0, 0], rtol=1e-4, atol=1e-5)


# --- invariances


@pytest.mark.parametrize("view", CAMERAS)
def test_the_order_of_gaussians_changes_no_bit(either, view):
    arrays, camera = gaussians(300), CAMERAS[view]
    order = np.random.default_rng(5).permutation(300)
    gradients = image_gradients(camera, 3)
    seen, found = either.forward(**arrays, camera=camera), either.backward(*gradients)
    shuffled = either.forward(**taken(arrays, order), camera=camera), either.backward(*gradients)
    assert_same_bits(shuffled[0], seen)
    for name in NAMES:
        np.testing.assert_array_equal(getattr(shuffled[1], name), getattr(found, name)[order])


# --- the extremes


@pytest.mark.parametrize("scales", [(1.0, 1e-12, 1e-12), (1e-30, 1e-30, 1e-30)])
def test_what_has_no_area_is_nowhere_where_it_is_antialiased(isa, scales):
    raster = cpu.Rasterizer(antialiased=True, instruction_set=isa)
    seen = raster.forward(**one(scale=scales, opacity=0.99), camera=map_camera())
    assert not seen.alpha.any() and not raster.visible.any()
    assert not any(np.any(g) for g in parts(raster.backward(np.ones((16, 16, 3), np.float32))))


def test_of_equal_depths_the_lower_index_is_in_front(raster):
    red, green = one(opacity=0.9, colour=(1, 0, 0)), one(opacity=0.9, colour=(0, 1, 0))
    for first, second in ((red, green), (green, red)):
        seen = raster.forward(**together(first, second), camera=map_camera())
        np.testing.assert_allclose(seen.colour[8, 8], (0.9 * first["colours"] + 0.09 * second["colours"])[0], rtol=1e-4)


# --- what is refused


def test_arrays_that_do_not_fit_are_refused(raster):
    arrays, camera = gaussians(40), CAMERAS["pinhole"]
    with pytest.raises(ValueError, match="means must be C-contiguous"):
        raster.forward(**(arrays | {"means": np.asfortranarray(arrays["means"])}), camera=camera)
    with pytest.raises(ValueError, match="focal lengths must be positive"):
        raster.forward(**arrays, camera=replace(camera, fx=-1.0))
    with pytest.raises(ValueError, match="1 to 32767 pixels a side"):
        raster.forward(**arrays, camera=replace(camera, width=0))
    raster.forward(**arrays, camera=camera)
    with pytest.raises(ValueError, match=r"grad_colour must have shape \(52, 70, 3\)"):
        raster.backward(np.zeros((70, 52, 3), np.float32))
    with pytest.raises(ValueError, match="x must be an array of float32, not float64"):
        interface.check(np.zeros(3), "x", (3,))
    with pytest.raises(ValueError, match=r"x must have shape \(3,\), not \(4,\)"):
        interface.check(np.zeros(4, np.float32), "x", (3,))


def test_an_instruction_set_that_is_not_there_is_refused(monkeypatch):
    monkeypatch.setenv("DAV_GSWT_ISA", "v9")
    with pytest.raises(ValueError, match="DAV_GSWT_ISA=v9: this processor has"):
        cpu.Rasterizer()
    monkeypatch.setenv("DAV_GSWT_ISA", cpu.instruction_sets()[-1])
    assert cpu.default_instruction_set() == cpu.instruction_sets()[-1]


def test_the_number_of_threads_can_be_set_from_outside(monkeypatch):
    monkeypatch.setenv("DAV_GSWT_THREADS", "3")
    assert cpu.Rasterizer().threads == 3
    monkeypatch.setenv("DAV_GSWT_THREADS", "many")
    with pytest.raises(ValueError, match="DAV_GSWT_THREADS=many"):
        cpu.Rasterizer()
