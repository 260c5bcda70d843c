"""The core against the float64 oracle.

Tolerances: some hundred float32 roundings a pixel (6e-8 each), 1e-5. See test_backends.py for the scenes of all.
"""

import numpy as np
import pytest
import torch
from fixtures.raster_scenes import CAMERAS, gaussians, image_gradients, oracle_answers, pixel_middles, relative
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.raster import cpu, harmonics, oracle


@pytest.mark.parametrize("logit", [8.0, 20.0])
def test_gradients_by_nearly_full_opacity_keep_their_digits(raster, logit):
    """1 - opacity is 1 / (1 + exp(logit)); the difference itself has lost all its digits at 17."""
    camera, gradients = CAMERAS["pinhole"], image_gradients(CAMERAS["pinhole"], 3)
    arrays = gaussians(40) | {"opacity_logits": np.full(40, logit, np.float32)}
    _, wanted = oracle_answers(arrays, camera, gradients)
    raster.forward(**arrays, camera=camera)
    assert relative(raster.backward(*gradients).opacity_logits, wanted["opacity_logits"]) < 1e-5


@pytest.mark.parametrize("view", CAMERAS)
def test_harmonics_are_those_of_a_fields_colours(raster, view):
    arrays, camera = gaussians(200), CAMERAS[view]
    for degree in range(4):
        sh = np.random.default_rng(4).normal(0, 0.5, (200, (degree + 1) ** 2, 3)).astype(np.float32)
        plain = arrays | {"colours": harmonics.seen_colours(sh, arrays["means"], camera)}
        wanted = raster.forward(**plain, camera=camera).colour
        found = raster.forward(**(arrays | {"colours": sh}), camera=camera).colour
        np.testing.assert_allclose(found, wanted, atol=1e-5)  # sums of 16 products, then as many splats


def test_no_pixel_of_a_thin_or_tilted_splat_is_left_out(raster):
    """Blocks of pixels that a splat's ellipse does not meet are skipped: none with a pixel inside may be."""
    arrays, camera = gaussians(200), CAMERAS["pinhole"]
    rng = np.random.default_rng(11)
    arrays["log_scales"] = rng.uniform(np.log(1e-3), np.log(2.0), (200, 3)).astype(np.float32)
    arrays["opacity_logits"] = rng.uniform(-5, -3, 200).astype(np.float32)  # so faint that no pixel is ever full
    tensors = {name: torch.tensor(values, dtype=torch.float64) for name, values in arrays.items()}
    splats = oracle.project(**tensors, camera=camera)
    wanted = int((oracle.weights(splats.shapes, pixel_middles(camera)) > 0).sum())
    raster.forward(**arrays, camera=camera)
    assert wanted > 10_000 and abs(raster._core.pairs(raster._last.state) - wanted) <= 1e-4 * wanted + 1


@settings(max_examples=20, derandomize=True)
@given(
    st.booleans(),
    st.sampled_from(sorted(CAMERAS)),
    st.integers(0, 1 << 16),
    st.lists(st.tuples(*[st.floats(-12, 6)] * 3), min_size=1, max_size=4),
)
def test_scales_from_1e_12_to_1e6_are_drawn_as_the_oracle_draws_them(antialiased, view, seed, sizes):
    """Needles too. Along one terms of some 1e4 cancel in the exponent: alpha is off by up to 1e-2 where it is steep."""
    arrays, camera = gaussians(len(sizes), seed), CAMERAS[view]
    arrays["log_scales"] = (np.log(10) * np.array(sizes)).astype(np.float32)
    gradients = image_gradients(camera, 3)
    (colour, alpha, _), _ = oracle_answers(arrays, camera, gradients, antialiased=antialiased)
    raster = cpu.Rasterizer(antialiased=antialiased)
    seen = raster.forward(**arrays, camera=camera)
    for found, wanted in ((seen.colour, colour), (seen.alpha, alpha)):
        assert np.abs(found - wanted).max() < 2e-2
        assert np.abs(found - wanted).mean() < 1e-4
    assert all(np.isfinite(g).all() for g in vars(raster.backward(*gradients)).values() if g is not None)
