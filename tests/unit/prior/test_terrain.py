"""The project's own prior, with weights that learned nothing: what it promises holds whatever they are."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from fixtures.prior_weights import write_weights
from safetensors.torch import load_file, save_file

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import pinhole
from dav_gswt.prior import weights
from dav_gswt.prior.interface import Condition, Prior, crop_camera, crop_image
from dav_gswt.prior.networks import LATENT, SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    torch.manual_seed(5)
    return write_weights(Network(), tmp_path_factory.mktemp("weights") / "terrain.safetensors")


@pytest.fixture(scope="module")
def prior(file):
    return TerrainPrior.open(file)


def condition(count=3, seed=0):
    rng, pixels = np.random.default_rng(seed), (count, SIZE, SIZE)
    shapes = (*pixels, 3), pixels, pixels, (*pixels, 3), (count, 4)
    return Condition(*(rng.uniform(0, 1, shape).astype(np.float32) for shape in shapes))


def test_dropout_alone_makes_samples_differ(prior):
    all_of_them = prior.sample(condition(), 2, 0.2, 2, 0)
    assert isinstance(prior, Prior) and all_of_them.shape == (3, 2, *LATENT)
    assert (all_of_them.var(axis=1).mean((1, 2, 3)) > 0).all()


def test_without_valid_pixels_the_render_has_no_influence(prior):
    one, two = condition(), replace(condition(seed=1), photo=condition().photo, relative=condition().relative)
    nothing = np.zeros((3, *LATENT[1:]), bool)
    found = [prior.sample(c, 1, 0.0, 2, 0, known=nothing) for c in (one, two)]
    np.testing.assert_allclose(*found, atol=1e-5)
    assert not np.allclose(prior.sample(one, 1, 0.0, 2, 0), prior.sample(two, 1, 0.0, 2, 0))


def test_a_condition_that_is_not_finite_is_refused_by_name(prior):
    bad = condition()
    bad.alpha[2, 0, 0] = np.nan
    with pytest.raises(ValueError, match="alpha of view 2"):
        prior.sample(bad, 2, 0.1, 2, 0)


PLACE = "told.place"


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda v: v | {PLACE: None}, "condition_encoder.place is missing"),
        (lambda v: v | {PLACE: v[PLACE][:5]}, f"{PLACE} has the shape"),
        (lambda v: v | {PLACE: v[PLACE] * torch.nan}, f"{PLACE} holds numbers that are not finite"),
        (lambda v: v | {"another": torch.zeros(1)}, "'another' is not of this network"),
    ],
)
def test_weights_of_another_network_are_refused_by_name(file, tmp_path, change, message):
    path = tmp_path / "weights.safetensors"
    save_file({name: v.contiguous() for name, v in change(load_file(file)).items() if v is not None}, str(path))
    with pytest.raises(InputError, match=f"weights.safetensors: {message}"):
        TerrainPrior.open(path)


def test_files_that_are_no_weights_are_refused(file, tmp_path, monkeypatch):
    path = tmp_path / "weights.safetensors"
    with pytest.raises(InputError, match="there are no such weights"):
        TerrainPrior.open(path)
    path.write_bytes(file.read_bytes()[:-1000])
    with pytest.raises(InputError, match="not readable as safetensors"):
        TerrainPrior.open(path)
    monkeypatch.setattr(weights, "MOST_BYTES", 1000)
    with pytest.raises(InputError, match="are not the weights of this prior"):
        TerrainPrior.open(path)


@pytest.mark.parametrize("width, height", [(16, 10), (10, 17), (12, 12)])
def test_the_square_of_a_picture_is_what_the_square_s_camera_sees(width, height):
    camera = pinhole([0.0, -3.0, 4.0], [0.2, 0.1, 0.0], width, height, 60.0)
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    image = np.stack([columns, rows, 0 * rows], -1).astype(np.float32)  # each pixel holds its own place
    square, cropped = crop_image(image), crop_camera(camera)
    side = min(width, height)
    assert square.shape == (side, side, 3) and (cropped.width, cropped.height) == (side, side)
    point = camera.centre + 2.0 * camera.forward
    (before, after), _ = zip(*(c.project(point[None]) for c in (camera, cropped)), strict=True)
    shift = square[0, 0, :2] - 0.5  # of the square in the picture
    np.testing.assert_allclose(before[0] - after[0], shift, atol=1e-9)
    lost = np.array([width, height]) - side - shift
    assert (np.abs(lost - shift) <= 1).all(), "as much is cut off on both sides"
