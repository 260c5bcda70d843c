"""The core against the float64 oracle. Tolerances: some hundred float32 roundings a pixel (6e-8 each), 1e-5."""

import numpy as np
import pytest
import torch
from fixtures.backend_scenes import SCENES, answers, blend_weights
from fixtures.raster_scenes import CAMERAS, NAMES, gaussians, image_gradients, oracle_answers, relative

from dav_gswt.raster import cpu, harmonics, oracle


@pytest.mark.parametrize("view", CAMERAS)
def test_images_and_gradients_are_the_oracles(raster, view):
    arrays, camera = gaussians(300), CAMERAS[view]
    gradients = image_gradients(camera, 3)
    images, wanted = oracle_answers(arrays, camera, gradients)
    seen = raster.forward(**arrays, camera=camera)
    for found, image in zip((seen.colour, seen.alpha, seen.depth), images, strict=True):
        np.testing.assert_allclose(found, image, atol=2e-5 * max(1, image.max()))
    found = raster.backward(*gradients)
    for name in NAMES:
        assert relative(getattr(found, name), wanted[name]) < 1e-5, name


@pytest.mark.parametrize("channels", [1, 2, 4, 5, 9])
def test_any_number_of_channels_is_drawn_and_taken_back(raster, channels):
    arrays, camera = gaussians(120, channels=channels), CAMERAS["pinhole"]
    gradients = image_gradients(camera, channels)
    images, wanted = oracle_answers(arrays, camera, gradients)
    seen = raster.forward(**arrays, camera=camera)
    for found, image in zip((seen.colour, seen.alpha, seen.depth), images, strict=True):
        np.testing.assert_allclose(found, image, atol=2e-5 * max(1, image.max()))
    found = raster.backward(*gradients)
    for name in NAMES:
        assert relative(getattr(found, name), wanted[name]) < 1e-5, name


@pytest.mark.parametrize("given", [(True, False, False), (True, True, False), (True, False, True)])
def test_a_gradient_left_out_counts_as_zero(given):
    arrays, camera = gaussians(100), CAMERAS["pinhole"]
    gradients = [g if ok else None for g, ok in zip(image_gradients(camera, 3), given, strict=True)]
    _, wanted = oracle_answers(arrays, camera, gradients)
    raster = cpu.Rasterizer()
    raster.forward(**arrays, camera=camera)
    found = raster.backward(*gradients)
    for name in NAMES:
        assert relative(getattr(found, name), wanted[name]) < 1e-5, name


@pytest.mark.parametrize("logit", [8.0, 14.0, 20.0])
def test_gradients_by_nearly_full_opacity_keep_their_digits(raster, logit):
    """1 - opacity is 1 / (1 + exp(logit)); the difference itself has lost all its digits at 17."""
    camera, gradients = CAMERAS["pinhole"], image_gradients(CAMERAS["pinhole"], 3)
    arrays = gaussians(40) | {"opacity_logits": np.full(40, logit, np.float32)}
    _, wanted = oracle_answers(arrays, camera, gradients)
    raster.forward(**arrays, camera=camera)
    assert relative(raster.backward(*gradients).opacity_logits, wanted["opacity_logits"]) < 1e-5


@pytest.mark.parametrize("scale, tolerance", [(1e-12, 1e-5), (1e6, 1e-5)])
def test_scales_far_out_are_drawn_as_the_oracle_draws_them(raster, scale, tolerance):
    arrays, camera = gaussians(60), CAMERAS["pinhole"]
    arrays["log_scales"] += np.float32(np.log(scale)) - arrays["log_scales"].mean()
    (colour, alpha, _), wanted = oracle_answers(arrays, camera, image_gradients(camera, 3))
    seen = raster.forward(**arrays, camera=camera)
    np.testing.assert_allclose(seen.colour, colour, atol=tolerance)
    np.testing.assert_allclose(seen.alpha, alpha, atol=tolerance)
    found = raster.backward(*image_gradients(camera, 3))
    for name in ("colours", "opacity_logits"):
        assert relative(getattr(found, name), wanted[name]) < 1e-4, name


def test_a_needle_keeps_its_digits(raster):
    """Along a needle terms of some 1e4 cancel in the exponent: 1e-7 of them is 1e-3 of alpha."""
    arrays, camera = gaussians(40), CAMERAS["pinhole"]
    arrays["log_scales"][:] = np.log([[1e3, 1e-3, 1e-3]])
    gradients = image_gradients(camera, 3)
    (colour, _, _), wanted = oracle_answers(arrays, camera, gradients)
    seen = raster.forward(**arrays, camera=camera)
    assert relative(seen.colour, colour) < 1e-3
    found = raster.backward(*gradients)
    for name in NAMES:
        assert relative(getattr(found, name), wanted[name]) < 1e-2, name


def test_the_dilation_is_the_variance_added_on_the_screen(raster, isa):
    arrays, camera = gaussians(60), CAMERAS["pinhole"]
    (colour, _, _), _ = oracle_answers(arrays, camera, image_gradients(camera, 3), dilation=2.0)
    wide = cpu.Rasterizer(dilation=2.0, instruction_set=isa).forward(**arrays, camera=camera)
    np.testing.assert_allclose(wide.colour, colour, atol=1e-5)
    assert np.abs(raster.forward(**arrays, camera=camera).colour - wide.colour).max() > 0.01


@pytest.mark.parametrize("name", SCENES)
def test_every_instruction_set_draws_the_scenes_of_all_backends(isa, name):
    """test_backends.py asks the best one only; tolerances as there."""
    scene = SCENES[name]
    pictures, shown, wanted = answers(name)
    raster = cpu.Rasterizer(**scene.options, instruction_set=isa)
    seen = raster.forward(**scene.arrays, camera=scene.camera)
    for found, image in zip((seen.colour, seen.alpha, seen.depth, seen.features), pictures, strict=False):
        np.testing.assert_allclose(found, image, atol=scene.image * max(1, np.abs(image).max()))
    gradients = raster.backward(*shown)
    for parameter, value in wanted.items():
        assert relative(getattr(gradients, parameter), value) < scene.gradient, parameter


@pytest.mark.parametrize("view", CAMERAS)
@pytest.mark.parametrize("degree", range(4))
def test_harmonics_are_those_of_a_fields_colours(raster, view, degree):
    arrays, camera = gaussians(200), CAMERAS[view]
    sh = np.random.default_rng(4).normal(0, 0.5, (200, (degree + 1) ** 2, 3)).astype(np.float32)
    plain = arrays | {"colours": harmonics.colours(sh, harmonics.directions(arrays["means"], camera))}
    wanted = raster.forward(**plain, camera=camera).colour
    found = raster.forward(**(arrays | {"colours": sh}), camera=camera).colour
    np.testing.assert_allclose(found, wanted, atol=1e-5)  # sums of 16 products, then as many splats


@pytest.mark.parametrize("name", ["a cloud", "a ground seen from low down", "antialiased", "opacities up to 1"])
def test_pairs_are_counted_where_a_pixel_takes_a_splat(raster, isa, name):
    scene = SCENES[name]
    wanted = (blend_weights(name) > 0).sum()
    raster = cpu.Rasterizer(**scene.options, instruction_set=isa)
    raster.forward(**scene.arrays, camera=scene.camera)
    assert abs(raster.count_pairs() - wanted) <= 1e-4 * wanted + 1  # at a splat's rim 1/255 may be missed by a rounding


@pytest.mark.parametrize("channels", [0, 3])
def test_pictures_without_channels_have_alpha_and_depth(raster, channels):
    arrays, camera = gaussians(120), CAMERAS["pinhole"]
    gradients = image_gradients(camera, 3)
    _, wanted = oracle_answers(arrays, camera, (np.zeros_like(gradients[0]), *gradients[1:]))
    bare = arrays | {"colours": arrays["colours"][:, :channels].copy()}
    raster.forward(**bare, camera=camera)
    found = raster.backward(np.zeros((*gradients[1].shape, channels), np.float32), *gradients[1:])
    for name in ("means", "log_scales", "quats", "opacity_logits"):
        assert relative(getattr(found, name), wanted[name]) < 1e-5, name


@pytest.mark.parametrize("features", [0, 1, 4, 7])
def test_features_are_channels_of_a_picture_of_their_own(raster, features):
    arrays, camera = gaussians(120), CAMERAS["pinhole"]
    extra = gaussians(120, seed=3, channels=features)["colours"]
    both = arrays | {"colours": np.concatenate([arrays["colours"], extra], 1)}
    joined = raster.forward(**both, camera=camera).colour
    grad = image_gradients(camera, 3 + features)[0]
    wanted = raster.backward(grad)
    seen = raster.forward(**arrays, camera=camera, features=extra)
    np.testing.assert_array_equal(np.concatenate([seen.colour, seen.features], 2), joined)
    found = raster.backward(grad[..., :3].copy(), None, None, grad[..., 3:].copy())
    np.testing.assert_array_equal(np.concatenate([found.colours, found.features], 1), wanted.colours)
    for name in ("means", "log_scales", "quats", "opacity_logits", "camera"):
        assert relative(getattr(found, name), getattr(wanted, name)) < 1e-5, (
            name
        )  # other groups of channels, other sums


@pytest.mark.parametrize("view", CAMERAS)
@pytest.mark.parametrize("antialiased", [False, True])
def test_splats_that_reach_in_from_outside_are_not_left_out(isa, view, antialiased):
    arrays, camera = gaussians(400, seed=9), CAMERAS[view]
    arrays["means"] *= 2.5
    arrays["log_scales"] += 1
    gradients = image_gradients(camera, 3)
    images, wanted = oracle_answers(arrays, camera, gradients, antialiased=antialiased)
    raster = cpu.Rasterizer(antialiased=antialiased, instruction_set=isa)
    seen = raster.forward(**arrays, camera=camera)
    for found, image in zip((seen.colour, seen.alpha, seen.depth), images, strict=True):
        np.testing.assert_allclose(found, image, atol=2e-5 * max(1, image.max()))
    found = raster.backward(*gradients)
    for name in NAMES:
        assert relative(getattr(found, name), wanted[name]) < 2e-5, name


def test_no_pixel_of_a_thin_or_tilted_splat_is_left_out(raster):
    """Blocks of pixels that a splat's ellipse does not meet are skipped: none with a pixel inside may be."""
    arrays, camera = gaussians(400), CAMERAS["pinhole"]
    rng = np.random.default_rng(11)
    arrays["log_scales"] = rng.uniform(np.log(1e-3), np.log(2.0), (400, 3)).astype(np.float32)
    arrays["opacity_logits"] = rng.uniform(-5, -3, 400).astype(np.float32)  # so faint that no pixel is ever full
    tensors = {name: torch.tensor(values, dtype=torch.float64) for name, values in arrays.items()}
    view = oracle.move_camera(camera, None, tensors["means"])
    splats = oracle.project(**tensors, camera=camera, view=view)
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    wanted = int((oracle.weights(splats, torch.as_tensor(np.stack([x.ravel(), y.ravel()], 1))) > 0).sum())
    raster.forward(**arrays, camera=camera)
    assert wanted > 10_000 and abs(raster.count_pairs() - wanted) <= 1e-4 * wanted
