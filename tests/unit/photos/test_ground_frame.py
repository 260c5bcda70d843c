"""The ground frame: a robust plane, and a square that is seen well."""

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.photos import ground_frame
from dav_gswt.photos.colmap_model import reprojection_errors, transform_model
from dav_gswt.photos.ground_frame import (
    find_visible_points,
    fit_ground_frame,
    fit_plane,
)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture(autouse=True)
def few_turns(monkeypatch):
    """Fewer directions of the x axis, on coarser grids: quick, and otherwise the same."""
    monkeypatch.setattr(ground_frame, "TURN", 15)
    monkeypatch.setattr(ground_frame, "COARSE_CELLS", 64)


@pytest.fixture
def flown(rng):
    """Twenty photos over a ground with a little relief."""
    return synth.model(synth.flight(4, 5), synth.plain(3000, 1.0, rng, relief=0.01))


def tossed(scene, rng):
    """The scene in an arbitrary frame, as structure from motion leaves it."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return transform_model(scene, 7.0, turn, np.array([30.0, -20.0, 11.0]))


def test_the_frame_has_z_up_the_ground_at_0_and_the_flying_height_as_unit(flown, rng):
    framed, facts = fit_ground_frame(tossed(flown, rng), rng)
    heights = np.array([c.centre[2] for c in framed.cameras])
    assert np.median(heights) == pytest.approx(1, abs=1e-9)
    assert all(c.forward[2] < -0.9 for c in framed.cameras)
    # 3000 heights of 0.01: their robust mean is within 0.001.
    assert np.median(framed.points[:, 2]) == pytest.approx(0, abs=1e-3)
    assert facts.relief == pytest.approx(0.01, rel=0.2)
    assert reprojection_errors(framed).max() < 1e-9  # pixels: a similarity changes no picture


def test_every_point_of_the_exemplar_is_seen_often_enough(flown, rng):
    framed, facts = fit_ground_frame(tossed(flown, rng), rng)
    square = facts.exemplar
    corner = np.array([square.west, square.south, 0])
    probes = corner + np.c_[rng.random((2000, 2)), np.zeros(2000)] * square.side
    assert sum(find_visible_points(c, probes).astype(int) for c in framed.cameras).min() >= 3
    extent = facts.extent
    assert extent.west <= square.west and extent.south <= square.south
    assert extent.east >= square.west + square.side and extent.north >= square.south + square.side


def test_photos_of_a_wall_or_of_no_common_ground_are_refused(rng):
    """Cameras in the plane of their points: there is no ground under them."""
    points = synth.plain(500, 1.0, rng, relief=0.05)
    cameras = [synth.camera((x, -3.0, 0.01), (x, 0, 0)) for x in np.linspace(-0.5, 0.5, 8)]
    with pytest.raises(InputError, match="ground"):
        fit_ground_frame(synth.model(cameras, points), rng)
    cameras = [synth.camera((3.0 * i, 0, 1)) for i in range(4)]
    points = np.concatenate([synth.plain(100, 0.3, rng) + [3.0 * i, 0, 0] for i in range(4)])
    with pytest.raises(InputError, match="no ground"):
        fit_ground_frame(synth.model(cameras, points), rng)


def test_four_in_ten_points_above_the_ground_do_not_tilt_the_plane(rng):
    points = synth.plain(1000, 1.0, rng, relief=0.005)
    points[:400, 2] += rng.uniform(0.05, 0.8, 400) * (points[:400, 0] + 1)  # trees, on one side more than on the other
    normal, offset, spread = fit_plane(points, rng)
    # An unweighted fit tilts by 0.1. Here 600 normal heights of 0.005 fix the tilt to about 0.005 / sqrt(600 / 3),
    # and the lowest of the trees, which nothing tells from ground, add their share.
    assert np.hypot(*normal[:2]) < 0.005 and abs(offset) < 0.003
    assert 0.004 < spread < 0.012


def test_up_says_on_which_side_the_normal_is_and_leaves_out_steep_planes(rng):
    """More points lie in a wall than on the ground."""
    wall = np.c_[np.full(700, 2.0), rng.uniform(-1, 1, (700, 2))]
    points = np.concatenate([synth.plain(300, 1.0, rng), wall])
    assert np.abs(fit_plane(points, rng)[0]) == pytest.approx([1, 0, 0], abs=1e-3)
    for side in (1.0, -1.0):
        assert fit_plane(points, rng, np.array([0.3, 0, side]))[0] == pytest.approx([0, 0, side], abs=0.05)


@pytest.mark.parametrize("points", [np.zeros((2, 3)), np.outer(np.arange(9.0), [1, 2, 3])], ids=["two", "a line"])
def test_points_that_fix_no_plane_are_refused(points, rng):
    with pytest.raises(InputError, match="points"):
        fit_plane(points, rng)
