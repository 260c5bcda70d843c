"""Where synthetic scenes are photographed from."""

import numpy as np
import pytest

from dav_gswt.geometry import camera_layouts


def camera(elevation, azimuth, radius=7.0, target=(1.0, 2.0, 0.5)):
    return camera_layouts.orbit(elevation, azimuth, radius, target, 60, 40, 90.0)


@pytest.mark.parametrize(
    "elevation, azimuth, centre",
    [
        pytest.param(90, 0, (1, 2, 7.5), id="above"),
        pytest.param(0, 0, (8, 2, 0.5), id="east"),
        pytest.param(0, 90, (1, 9, 0.5), id="north"),
        pytest.param(30, 180, (1 - 7 * 3**0.5 / 2, 2, 4), id="west, half way up"),
    ],
)
def test_a_place_is_where_its_angles_say(elevation, azimuth, centre):
    assert camera(elevation, azimuth).centre == pytest.approx(np.array(centre, float), abs=1e-12)


def test_the_target_is_in_the_middle_of_the_picture_at_the_radius():
    for elevation in (-90, -20, 0, 33, 90):
        pixels, depth = camera(elevation, 77.0).project(np.array([[1.0, 2.0, 0.5]]))
        assert pixels[0] == pytest.approx([30, 20], abs=1e-9)
        assert depth[0] == pytest.approx(7.0)


def test_the_field_of_view_is_that_of_the_width():
    assert camera(40, 0).fx == pytest.approx(30.0)  # 90 degrees: half the width over tan 45


def test_up_is_up_in_the_picture():
    pixels, _ = camera(40, 120).project(np.array([[1.0, 2.0, 1.5]]))
    assert pixels[0, 0] == pytest.approx(30) and pixels[0, 1] < 20


def test_from_straight_above_the_top_is_what_it_tends_to():
    near, at = camera(90 - 1e-7, 120), camera(90, 120)
    assert at.rotation == pytest.approx(near.rotation, abs=1e-8)  # 1e-7 degrees are 2e-9 radians
    assert np.linalg.det(at.rotation) == pytest.approx(1.0)


def test_azimuth_0_is_360():
    one, other = camera(40, 0), camera(40, 360)
    assert (one.rotation == other.rotation).all() and (one.translation == other.translation).all()


@pytest.mark.parametrize(
    "elevation, radius", [(40, 0), (40, -1), (91, 7), (-90.5, 7), (float("nan"), 7), (40, float("inf"))]
)
def test_a_place_that_is_none_is_refused(elevation, radius):
    with pytest.raises(ValueError, match="no camera stands"):
        camera(elevation, 0, radius)


def test_the_start_ring_has_one_view_from_above_and_the_others_evenly_around():
    assert camera_layouts.start_ring(4, 65.0, 7.0) == [(90, 0, 7), (65, 0, 7), (65, 120, 7), (65, 240, 7)]
    assert camera_layouts.start_ring(1, 65.0, 7.0) == [(90, 0, 7)]
    with pytest.raises(ValueError):
        camera_layouts.start_ring(0, 65.0, 7.0)


def test_a_hemisphere_is_uniform_by_area():
    height = np.sin(np.radians([e for e, _, _ in camera_layouts.hemisphere(1000, 30.0, 7.0)]))
    # heights of points uniform on a sphere are uniform: here every tenth of [0.5, 1] has a tenth of the points
    assert (np.histogram(height, bins=10, range=(0.5, 1.0))[0] == 100).all()
    azimuth = np.array([a for _, a, _ in camera_layouts.hemisphere(1000, 30.0, 7.0)])
    # a golden-angle sequence fills arcs with a discrepancy of a few points
    assert np.abs(np.histogram(azimuth, bins=10, range=(0, 360))[0] - 100).max() <= 5


def test_hemispheres_of_any_number_are_made():
    assert camera_layouts.hemisphere(0, 30.0, 7.0) == []
    [(elevation, _, radius)] = camera_layouts.hemisphere(1, 30.0, 7.0)
    assert np.sin(np.radians(elevation)) == pytest.approx(0.75) and radius == 7.0


def test_test_views_are_distinct_from_each_other_and_from_every_other_view():
    def centres(places):
        return np.array([camera(*place).centre for place in places])

    tests = centres(camera_layouts.held_out(6, 30.0, 7.0))
    others = centres(camera_layouts.start_ring(8, 65.0, 7.0) + camera_layouts.hemisphere(250, 30.0, 7.0))
    assert np.linalg.norm(tests[:, None] - others, axis=-1).min() >= 0.7 - 1e-9  # a tenth of the radius
    assert np.linalg.norm(tests[:, None] - tests, axis=-1)[~np.eye(6, dtype=bool)].min() > 1.0


def test_a_ring_is_even_and_turned():
    assert camera_layouts.ring(4, 45.0, 7.0, turn=20.0) == [(45, 20, 7), (45, 110, 7), (45, 200, 7), (45, 290, 7)]
    assert camera_layouts.ring(0, 45.0, 7.0) == []


@pytest.mark.parametrize("n, circle", [(100, 36), (72, 36), (71, 26), (50, 18), (3, 1)])
def test_a_paper_rig_has_36_in_100_views_on_a_circle_and_the_others_uniform_above_the_lowest(n, circle):
    places = camera_layouts.paper(n, 45.0, 30.0, 7.0)
    assert len(places) == n
    assert [e for e, _, _ in places[:circle]] == circle * [45.0]
    assert np.diff([a for _, a, _ in places[:circle]]) == pytest.approx((circle - 1) * [360 / circle])
    height = np.sin(np.radians([e for e, _, _ in places[circle:]]))
    # equal steps of height are equal areas of the sphere
    assert height == pytest.approx(1 - (np.arange(n - circle) + 0.5) / (n - circle) * 0.5)


def test_a_walker_stands_away_from_the_target_and_looks_past_it_to_the_horizon():
    camera = camera_layouts.eye_level_camera(1.6, 90.0, 4.0, (1.0, 2.0, 0.5), 160, 90, 60.0)
    assert camera.centre == pytest.approx(np.array([1.0, 6.0, 2.1]))
    horizon = camera.centre + np.array([[0.0, -1.0, 0.0]])
    [pixel], _ = camera.project(horizon)
    # 12 degrees above the middle: a focal length of 80 / tan 30 pixels times tan 12
    assert pixel == pytest.approx([80, 45 - 80 * 3**0.5 * np.tan(np.radians(12))])
    with pytest.raises(ValueError, match="above the ground"):
        camera_layouts.eye_level_camera(0.0, 0.0, 4.0, (0.0, 0.0, 0.0), 160, 90, 60.0)
