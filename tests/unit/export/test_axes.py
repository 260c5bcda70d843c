"""Fields in the axes of other formats: known Gaussians, and pictures that stay the same."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dav_gswt import raster
from dav_gswt.export.axes import Y_DOWN, Z_UP, turn_field
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import pinhole
from dav_gswt.raster.harmonics import basis, colours

ANY = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()


@pytest.fixture
def known():
    """Twenty Gaussians of three unlike axes whose colours depend on the view, up to degree 3."""
    rng = np.random.default_rng(8)
    return GaussianField(
        rng.uniform(-0.5, 0.5, (20, 3)).astype(np.float32),
        np.log(rng.uniform(0.03, 0.2, (20, 3))).astype(np.float32),
        rng.normal(size=(20, 4)).astype(np.float32),
        rng.normal(1, 1, 20).astype(np.float32),
        rng.normal(0, 0.3, (20, 16, 3)).astype(np.float32),
        np.zeros(20, np.float32),
        np.zeros(20, bool),
    )


def covariances(field):
    turn = Rotation.from_quat(field.quats[:, [1, 2, 3, 0]]).as_matrix()
    return np.einsum("nij,nj,nkj->nik", turn, np.exp(2.0 * field.log_scales), turn)


def test_up_is_minus_y_north_is_z_and_east_stays():
    east, north, up = Y_DOWN.T
    assert (east.tolist(), north.tolist(), up.tolist()) == ([1, 0, 0], [0, 0, 1], [0, -1, 0])


def test_a_disc_on_the_ground_is_thin_along_y_after_it():
    disc = GaussianField(
        np.float32([[1, 2, 3]]),
        np.log(np.float32([[0.3, 0.2, 0.01]])),
        np.float32([[1, 0, 0, 0]]),
        np.zeros(1, np.float32),
        np.zeros((1, 1, 3), np.float32),
        np.zeros(1, np.float32),
        np.ones(1, bool),
    )
    turned = turn_field(disc, Y_DOWN)
    assert turned.means.tolist() == [[1, -3, 2]]
    assert covariances(turned)[0] == pytest.approx(np.diag([0.09, 0.0001, 0.04]), abs=1e-7)


@pytest.mark.parametrize("rotation", [Y_DOWN, Z_UP, ANY])
def test_covariances_turn_with_the_frame_and_back_gives_the_field_again(known, rotation):
    turned = turn_field(known, rotation)
    assert covariances(turned) == pytest.approx(rotation @ covariances(known) @ rotation.T, abs=1e-6)
    again = turn_field(turned, rotation.T)
    assert again.means == pytest.approx(known.means, abs=1e-6)
    assert covariances(again) == pytest.approx(covariances(known), abs=1e-6)
    assert again.sh == pytest.approx(known.sh, abs=1e-5)
    assert np.array_equal(again.log_scales, known.log_scales)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_colour_goes_with_its_direction(known, degree):
    directions = np.random.default_rng(1).normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    some = replace(known, sh=np.ascontiguousarray(known.sh[:, : (degree + 1) ** 2]))
    turned = turn_field(some, ANY)
    assert colours(turned.sh, directions @ ANY.T) == pytest.approx(colours(some.sh, directions), abs=1e-5)
    if degree:
        assert basis(directions @ ANY.T, degree) != pytest.approx(basis(directions, degree), abs=0.1)


def test_a_picture_taken_from_the_turned_place_is_the_same(known):
    camera = pinhole((1.2, -0.9, 0.8), (0, 0, 0), 48, 40, 60.0)
    moved = replace(camera, rotation=camera.rotation @ Y_DOWN.T)
    before, after = raster.render(known, camera), raster.render(turn_field(known, Y_DOWN), moved)
    assert np.ptp(before.colour) > 0.2
    assert after.colour == pytest.approx(before.colour, abs=1e-4)


@pytest.mark.parametrize("matrix", [np.diag([1.0, 1, -1]), 2 * np.eye(3)])
def test_a_mirror_or_a_scale_is_no_turn(known, matrix):
    with pytest.raises(ValueError, match="proper rotation"):
        turn_field(known, matrix)
