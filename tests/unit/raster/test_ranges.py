"""Invariances and extremes over whole ranges, for both modes and both kinds of camera."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, gaussians, image_gradients, oracle_answers, taken
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dav_gswt.raster import cpu

MODES = st.booleans()
VIEWS = st.sampled_from(sorted(CAMERAS))
SEEDS = st.integers(0, 1 << 16)
quick = settings(max_examples=40, derandomize=True)


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
@given(MODES, SEEDS, st.floats(-3, 3))
def test_scaling_scene_and_pinhole_together_scales_only_depth(antialiased, seed, exponent):
    factor, arrays, camera = 10**exponent, gaussians(150, seed), CAMERAS["pinhole"]
    scaled = arrays | {
        "means": (arrays["means"] * factor).astype(np.float32),
        "log_scales": (arrays["log_scales"] + np.log(factor)).astype(np.float32),
    }
    away = replace(camera, translation=camera.translation * factor)
    large = drawn(scaled, away, antialiased, near=0.01 * factor)
    assert_alike(large, drawn(arrays, camera, antialiased), factor)


@quick
@given(MODES, SEEDS, st.floats(-3, 3))
def test_scaling_scene_and_map_together_scales_only_depth(antialiased, seed, exponent):
    factor, arrays, camera = 10**exponent, gaussians(150, seed), CAMERAS["orthographic"]
    scaled = arrays | {
        "means": (arrays["means"] * factor).astype(np.float32),
        "log_scales": (arrays["log_scales"] + np.log(factor)).astype(np.float32),
    }
    wider = replace(
        camera, translation=camera.translation * factor, fx=float(camera.fx / factor), fy=float(camera.fy / factor)
    )
    assert_alike(drawn(scaled, wider, antialiased), drawn(arrays, camera, antialiased), factor)


@quick
@given(MODES, VIEWS, SEEDS, st.integers(1, 300))
def test_any_order_gives_the_same_picture(antialiased, view, seed, n):
    arrays = gaussians(n, seed)
    order = np.random.default_rng(seed).permutation(n)
    a, b = (drawn(some, CAMERAS[view], antialiased) for some in (arrays, taken(arrays, order)))
    np.testing.assert_array_equal(a.colour, b.colour)


@quick
@given(MODES, VIEWS, SEEDS, st.floats(-30, 30), st.sampled_from([-1, 1]))
def test_a_quaternion_of_any_length_and_sign_is_the_same_turn(antialiased, view, seed, exponent, sign):
    arrays = gaussians(80, seed)
    longer = arrays | {"quats": (arrays["quats"] * (sign * 10.0**exponent)).astype(np.float32)}
    assert_alike(*(drawn(some, CAMERAS[view], antialiased) for some in (longer, arrays)))


@quick
@given(MODES, VIEWS, SEEDS, st.floats(0.0, 1.0))
def test_what_is_taken_and_what_is_left_make_one(antialiased, view, seed, background):
    """Colours of 1 over any background of 1 give 1; over another the picture is linear in it."""
    arrays = gaussians(200, seed) | {"colours": np.ones((200, 2), np.float32)}
    seen = drawn(arrays, CAMERAS[view], antialiased)
    over = seen.colour + (1 - seen.alpha)[..., None] * np.float32([1, background])
    np.testing.assert_allclose(over[..., 0], 1, atol=5e-6)  # sum of w against the product of 1 - alpha
    np.testing.assert_allclose(over[..., 1], seen.alpha + (1 - seen.alpha) * background, atol=5e-6)


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


@quick
@given(MODES, st.floats(1e-3, 10.0), st.sampled_from([0.0, 1e-8, 0.99, 1.0, 1.01, -1.0]))
def test_the_near_plane_cuts_by_the_centre(antialiased, near, share):
    depth = np.float32(near * share)
    camera = replace(CAMERAS["pinhole"], rotation=np.eye(3), translation=np.zeros(3))
    arrays = gaussians(1) | {"means": np.array([[0, 0, depth]], np.float32), "opacity_logits": np.ones(1, np.float32)}
    arrays["log_scales"] = np.full((1, 3), np.log(0.1 * near), np.float32)
    raster = cpu.Rasterizer(near=near, antialiased=antialiased)
    seen = raster.forward(**arrays, camera=camera)
    assert seen.alpha.any() == raster.visible[0] == (depth >= np.float32(near))
    found = raster.backward(*image_gradients(camera, 3))
    assert all(np.isfinite(g).all() for g in vars(found).values() if g is not None)


@pytest.mark.parametrize("antialiased", [False, True])
@pytest.mark.parametrize("turn", [0, 360])
@pytest.mark.parametrize("elevation", [90, -90])
def test_a_map_turned_once_around_and_one_from_below_are_pictures(antialiased, turn, elevation):
    arrays, camera = gaussians(100), CAMERAS["orthographic"]
    around = Rotation.from_euler("z", turn, degrees=True).as_matrix()
    if elevation < 0:
        around = np.diag([1.0, -1.0, -1.0]) @ around
    turned = replace(camera, rotation=camera.rotation @ around, translation=np.array([*camera.translation[:2], 5.0]))
    seen = drawn(arrays, turned, antialiased)
    assert seen.alpha.max() > 0.5
    if elevation > 0:
        assert_alike(seen, drawn(arrays, camera, antialiased))
