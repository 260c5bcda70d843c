"""The memory of gradients is used again, but never while somebody holds them; and what is not seen is not touched."""

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, gaussians, image_gradients, taken

from dav_gswt.raster import cpu

CAMERA = CAMERAS["pinhole"]


@pytest.fixture
def drawn(raster):
    raster.forward(**gaussians(100), camera=CAMERA)
    return raster


def address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def test_gradients_that_are_held_do_not_change(drawn):
    first = drawn.backward(image_gradients(CAMERA, 3)[0])
    kept = {name: array.copy() for name, array in vars(first).items() if array is not None}
    drawn.backward(np.zeros((52, 70, 3), np.float32))
    for name, array in kept.items():
        np.testing.assert_array_equal(getattr(first, name), array)


def test_a_view_of_a_gradient_holds_its_memory(drawn):
    part = drawn.backward(image_gradients(CAMERA, 3)[0]).means[10:20, 2]
    before = part.copy()
    drawn.backward(np.zeros((52, 70, 3), np.float32))
    np.testing.assert_array_equal(part, before)


def test_memory_that_nobody_holds_is_used_again(drawn):
    used = address(drawn.backward(image_gradients(CAMERA, 3)[0]).means)
    assert address(drawn.backward(image_gradients(CAMERA, 3)[0]).means) == used


def test_what_a_caller_wrote_into_gradients_does_not_come_back(raster):
    """Also where nothing is seen, and in parts of arrays that are zeroed as a whole."""
    arrays = gaussians(3000)
    arrays["means"][500:2200] += 1e4
    arrays["means"][2500:, 0] += np.float32([0, 1e4] * 250)
    grad = image_gradients(CAMERA, 3)
    raster.forward(**arrays, camera=CAMERA)
    wanted = {k: v.copy() for k, v in vars(raster.backward(*grad)).items() if v is not None}
    soiled = raster.backward(*grad)
    for array in vars(soiled).values():
        if array is not None:
            array[:] = np.nan
    del soiled, array
    for name, value in vars(raster.backward(*grad)).items():
        if value is not None:
            np.testing.assert_array_equal(value, wanted[name])


def test_what_lies_outside_changes_no_bit_of_what_is_seen(raster):
    """Who is left out early, and between whom, must not matter."""
    arrays, rng = gaussians(1500), np.random.default_rng(0)
    away = rng.uniform(size=1500) < 0.7
    arrays["means"][away] += np.float32([3e3, 0, 0])
    grad, sh = image_gradients(CAMERA, 3), rng.normal(size=(1500, 9, 3)).astype(np.float32)
    arrays["colours"] = sh
    results = []
    for some in (arrays, taken(arrays, ~away)):
        seen = raster.forward(**some, camera=CAMERA)
        results.append((seen, raster.visible, raster.backward(*grad), raster.contributions(grad[0])))
    (a, drawn, by, shares), (b, _, alone, shares_alone) = results
    assert drawn[~away].sum() > 300 and not drawn[away].any()
    for name in ("colour", "alpha", "depth"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    for found, wanted in ((by, alone), (shares, shares_alone)):
        for name, value in vars(wanted).items():
            if name == "camera":
                np.testing.assert_array_equal(by.camera, value)
            elif value is not None:
                np.testing.assert_array_equal(getattr(found, name)[~away], value)
                assert not getattr(found, name)[away].any(), name


def test_values_that_are_not_finite_far_outside_are_no_reason_to_stop(raster):
    arrays = gaussians(50)
    arrays["means"][7] += 1e4
    arrays["colours"][7] = np.nan
    assert np.isfinite(raster.forward(**arrays, camera=CAMERA).colour).all()
    arrays["means"][7, 1] = np.nan
    with pytest.raises(ValueError, match="means of Gaussian 7 is not finite"):
        raster.forward(**arrays, camera=CAMERA)


@pytest.mark.parametrize("k", [1, 4, 9, 16])
def test_a_coefficient_that_is_not_finite_is_named_with_its_index(raster, k):
    arrays = gaussians(50) | {"colours": np.ones((50, k, 3), np.float32)}
    arrays["colours"][raster_index(raster, arrays), k - 1, 2] = np.inf
    with pytest.raises(ValueError, match="colours of Gaussian .* is not finite"):
        raster.forward(**arrays, camera=CAMERA)


def raster_index(raster: cpu.Rasterizer, arrays) -> int:
    """A Gaussian that is seen."""
    raster.forward(**arrays, camera=CAMERA)
    return int(np.flatnonzero(raster.visible)[0])
