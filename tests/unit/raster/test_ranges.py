"""Invariances and extremes over whole ranges, for both modes and both kinds of camera."""

from dataclasses import replace

import numpy as np
from fixtures.raster_scenes import CAMERAS, gaussians, image_gradients, oracle_answers
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dav_gswt.raster import cpu

MODES = st.booleans()
VIEWS = st.sampled_from(sorted(CAMERAS))
SEEDS = st.integers(0, 1 << 16)
quick = settings(max_examples=20, derandomize=True)


def drawn(arrays, camera, antialiased: bool, **options) -> cpu.Rendering:
    return cpu.Rasterizer(antialiased=antialiased, **options).forward(**arrays, camera=camera)


def assert_alike(found: cpu.Rendering, wanted: cpu.Rendering, depth: float = 1.0):
    """Centres move by some 1e-5 pixels: by as much of a colour, but at a splat's rim alpha jumps by 1/255."""
    for name, scale in (("colour", 1), ("alpha", 1), ("depth", depth)):
        a, b = getattr(found, name) / scale, getattr(wanted, name)
        most = max(1, b.max())
        assert np.abs(a - b).max() < 3 / 255 * most
        assert np.abs(a - b).mean() < 2e-5 * most


@quick
@given(MODES, VIEWS, SEEDS)
def test_moving_scene_and_camera_together_changes_nothing(antialiased, view, seed):
    rng, arrays, camera = np.random.default_rng(seed), gaussians(150, seed), CAMERAS[view]
    turn, shift = Rotation.random(random_state=seed), rng.uniform(-3, 3, 3)
    x, y, z, w = turn.as_quat()
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])  # quaternion product from the left
    moved = arrays | {
        "means": np.ascontiguousarray(turn.apply(arrays["means"]) + shift, np.float32),
        "quats": (arrays["quats"] @ left.T).astype(np.float32),
    }
    rotation = camera.rotation @ turn.as_matrix().T
    elsewhere = replace(camera, rotation=rotation, translation=camera.translation - rotation @ shift)
    assert_alike(drawn(moved, elsewhere, antialiased), drawn(arrays, camera, antialiased))


@quick
@given(MODES, VIEWS, SEEDS, st.floats(-3, 3))
def test_scaling_scene_and_camera_together_scales_only_depth(antialiased, view, seed, exponent):
    factor, arrays, camera = 10**exponent, gaussians(150, seed), CAMERAS[view]
    scaled = arrays | {
        "means": (arrays["means"] * factor).astype(np.float32),
        "log_scales": (arrays["log_scales"] + np.log(factor)).astype(np.float32),
    }
    away = replace(camera, translation=camera.translation * factor)
    if camera.orthographic:  # a map of more ground
        away = replace(away, fx=float(camera.fx / factor), fy=float(camera.fy / factor))
    large = drawn(scaled, away, antialiased, near=0.01 * factor)
    assert_alike(large, drawn(arrays, camera, antialiased), factor)


SIZES = st.tuples(*[st.floats(-12, 6)] * 3)


@quick
@given(MODES, VIEWS, SEEDS, st.lists(SIZES, min_size=1, max_size=4))
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
