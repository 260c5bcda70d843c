"""The ground frame: coverage, the largest well-seen square."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from dav_gswt.errors import InputError
from dav_gswt.photos.colmap_model import reprojection_errors, transform_model
from dav_gswt.photos.ground_frame import (
    count_coverage,
    find_largest_square,
    find_visible_points,
    fit_ground_frame,
)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


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


def test_the_frame_does_not_depend_on_the_frame_before(flown, rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    one, a = fit_ground_frame(flown, np.random.default_rng(0))
    two, b = fit_ground_frame(transform_model(flown, 3.0, turn, np.ones(3)), np.random.default_rng(0))
    assert two.points == pytest.approx(one.points, abs=1e-6)
    assert b.exemplar.side == pytest.approx(a.exemplar.side, abs=1e-6)


def test_every_point_of_the_exemplar_is_seen_often_enough(flown, rng):
    framed, facts = fit_ground_frame(tossed(flown, rng), rng)
    square = facts.exemplar
    corner = np.array([square.west, square.south, 0])
    probes = corner + np.c_[rng.random((2000, 2)), np.zeros(2000)] * square.side
    assert sum(find_visible_points(c, probes).astype(int) for c in framed.cameras).min() >= 3
    extent = facts.extent
    assert extent.west <= square.west and extent.south <= square.south
    assert extent.east >= square.west + square.side and extent.north >= square.south + square.side


def test_the_x_axis_turns_so_that_the_square_is_large(rng):
    """A flight along a diagonal: the square is as large as that of the same flight along the axes."""
    cameras = synth.flight(4, 4, tilt=0)
    straight = synth.model(cameras, synth.plain(4000, 1.2, rng))
    c = np.sqrt(0.5)
    diagonal = transform_model(straight, 1.0, np.array([[c, -c, 0], [c, c, 0], [0, 0, 1]]), np.zeros(3))
    sides = [fit_ground_frame(m, np.random.default_rng(0))[1].exemplar.side for m in (straight, diagonal)]
    assert sides[1] == pytest.approx(sides[0], rel=0.03)  # two cells of about 70


def test_ground_without_points_is_not_well_seen(rng):
    """The northern half is water: photos see it, but nothing in it holds still."""
    points = synth.plain(4000, 1.0, rng)
    cameras = synth.flight(4, 5, tilt=0)
    all_over = fit_ground_frame(synth.model(cameras, points), rng)[1].exemplar
    half = fit_ground_frame(synth.model(cameras, points[points[:, 1] < 0]), rng)[1].exemplar
    assert half.side < 0.8 * all_over.side


def test_photos_that_look_along_a_wall_are_refused(rng):
    """Cameras in the plane of their points: there is no ground under them."""
    points = synth.plain(500, 1.0, rng, relief=0.05)
    cameras = [synth.camera((x, -3.0, 0.01), (x, 0, 0)) for x in np.linspace(-0.5, 0.5, 8)]
    with pytest.raises(InputError, match="ground"):
        fit_ground_frame(synth.model(cameras, points), rng)


def test_photos_that_see_no_common_ground_are_refused(rng):
    cameras = [synth.camera((3.0 * i, 0, 1)) for i in range(4)]
    points = np.concatenate([synth.plain(100, 0.3, rng) + [3.0 * i, 0, 0] for i in range(4)])
    with pytest.raises(InputError, match="no ground"):
        fit_ground_frame(synth.model(cameras, points), rng)


def test_coverage_counts_photos_by_hand():
    # Two cameras at height 1 see 320 / 300 by 240 / 300 of ground each; half a width apart they share half.
    width, height = 320 / 300, 240 / 300
    cameras = (synth.camera((0, 0, 1)), synth.camera((width / 2, 0, 1)))
    corners = np.array([[-width, -height, 0], [1.5 * width, height, 0]])
    grid = count_coverage(cameras, corners, cells=400)
    area = grid.cell**2
    assert (grid.counts == 2).sum() * area == pytest.approx(width * height / 2, rel=0.02)  # a cell of about 100
    assert (grid.counts == 1).sum() * area == pytest.approx(width * height, rel=0.02)


def test_what_is_behind_or_too_far_is_not_seen():
    camera = synth.camera((0, 0, 1), (1, 0, 1.0))  # looks along the ground
    points = np.array([[2.0, 0, 0.9], [2.99, 0, 0.99], [3.01, 0, 1.0], [-1.0, 0, 1.0]])
    assert find_visible_points(camera, points).tolist() == [True, True, False, False]


@pytest.mark.parametrize(
    "rows, answer",
    [
        (["0000", "0000"], (0, 0, 0)),
        (["0000", "0010"], (1, 2, 1)),
        (["1100", "1111", "0111", "0111"], (1, 1, 3)),
        (["11111", "11111"], (0, 1, 2)),  # four squares of side 2: one of the two nearest to the middle, the first
    ],
)
def test_the_largest_square_by_hand(rows, answer):
    assert find_largest_square(np.array([[c == "1" for c in row] for row in rows])) == answer


def brute_force(mask):
    """Side of the largest square of true cells by trying all."""
    rows, columns = mask.shape
    for side in range(min(rows, columns), 0, -1):
        for i in range(rows - side + 1):
            for j in range(columns - side + 1):
                if mask[i : i + side, j : j + side].all():
                    return side
    return 0


@settings(max_examples=60)
@given(
    arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.sampled_from([True, True, True, False]))
)
def test_the_largest_square_equals_brute_force(mask):
    row, column, side = find_largest_square(mask)
    assert side == brute_force(mask)
    assert mask[row : row + side, column : column + side].all()


def test_few_photos_need_two_looks_and_many_need_three(flown, rng):
    few = replace(flown, names=flown.names[:8], cameras=flown.cameras[:8])
    keep = few_obs = flown.image_of < 8
    few = replace(few, point_of=flown.point_of[keep], image_of=flown.image_of[few_obs], pixels=flown.pixels[keep])
    assert fit_ground_frame(few, rng)[1].photos_per_cell == 2
    assert fit_ground_frame(flown, rng)[1].photos_per_cell == 3
