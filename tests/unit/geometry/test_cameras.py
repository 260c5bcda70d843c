import numpy as np
import pytest

from dav_gswt.geometry import camera_layouts, cameras
from dav_gswt.geometry.cameras import camera_from_json, camera_to_json


def test_a_pinhole_sees_its_target_in_the_middle_and_up_is_up():
    camera = cameras.pinhole([3.0, 0, 4], [0, 0, 0], 100, 80, 60.0)
    pixels, depth = camera.project(np.array([[0.0, 0, 0], [0, 0, 0.5]]))
    np.testing.assert_allclose(pixels[0], [50, 40], atol=1e-9)
    assert depth[0] == pytest.approx(5)
    assert pixels[1, 1] < 40  # higher in the world is higher in the picture: rows grow downwards


def test_a_map_camera_puts_north_up_and_one_cell_on_one_pixel():
    camera = cameras.top_down(west=10.0, south=20.0, width=4, height=3, cell=0.5, top=7.0)
    south_west, north_east = np.array([[10.25, 20.25, 0], [11.75, 21.25, 5]])
    pixels, depth = camera.project(np.stack([south_west, north_east]))
    np.testing.assert_allclose(pixels, [[0.5, 2.5], [3.5, 0.5]])
    np.testing.assert_allclose(depth, [7, 2])


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_point_on_a_pixels_ray_projects_to_that_pixel(orthographic):
    made = cameras.pinhole([1.0, -2, 3], [0.3, 0.1, 0], 7, 5, 50.0)
    camera = cameras.Camera(**(vars(made) | {"orthographic": orthographic}))
    origin, step = camera.rays()
    pixels, depth = camera.project((origin + 2.5 * step).reshape(-1, 3))
    x, y = np.meshgrid(np.arange(7) + 0.5, np.arange(5) + 0.5)
    np.testing.assert_allclose(pixels, np.stack([x.ravel(), y.ravel()], 1), atol=1e-9)
    np.testing.assert_allclose(depth, 2.5)


def test_an_eye_at_its_target_is_refused():
    with pytest.raises(ValueError, match="coincide"):
        cameras.look_at([1, 2, 3], [1, 2, 3])


def test_a_camera_comes_back_from_json_as_it_was():
    camera = cameras.pinhole([1.0, -2, 3], [0, 0, 0], 64, 48, 50.0)
    back = camera_from_json(camera_to_json(camera))
    np.testing.assert_array_equal(back.rotation, camera.rotation)
    np.testing.assert_array_equal(back.translation, camera.translation)
    assert (back.fx, back.width, back.orthographic) == (camera.fx, 64, False)


def camera(elevation, azimuth, radius=7.0, target=(1.0, 2.0, 0.5)):
    return camera_layouts.orbit(elevation, azimuth, radius, target, 60, 40, 90.0)


def test_the_target_is_in_the_middle_of_the_picture_at_the_radius():
    for elevation in (-90, -20, 33, 90):
        pixels, depth = camera(elevation, 77.0).project(np.array([[1.0, 2.0, 0.5], [1.0, 2.0, 1.5]]))
        assert pixels[0] == pytest.approx([30, 20], abs=1e-9)
        assert depth[0] == pytest.approx(7.0)
        assert abs(elevation) == 90 or pixels[1, 1] < 20  # up is up
    assert camera(40, 0).fx == pytest.approx(30.0)  # 90 degrees: half the width over tan 45
    near, at = camera(90 - 1e-7, 120), camera(90, 120)
    assert at.rotation == pytest.approx(near.rotation, abs=1e-8)  # 1e-7 degrees are 2e-9 radians


def test_the_start_ring_has_one_view_from_above_and_the_others_evenly_around():
    assert camera_layouts.start_ring(4, 65.0, 7.0) == [(90, 0, 7), (65, 0, 7), (65, 120, 7), (65, 240, 7)]
    assert camera_layouts.ring(2, 45.0, 7.0, turn=20.0) == [(45, 20, 7), (45, 200, 7)]


def test_a_hemisphere_is_uniform_by_area():
    height = np.sin(np.radians([e for e, _, _ in camera_layouts.hemisphere(1000, 30.0, 7.0)]))
    # heights of points uniform on a sphere are uniform: here every tenth of [0.5, 1] has a tenth of the points
    assert (np.histogram(height, bins=10, range=(0.5, 1.0))[0] == 100).all()
    azimuth = np.array([a for _, a, _ in camera_layouts.hemisphere(1000, 30.0, 7.0)])
    # a golden-angle sequence fills arcs with a discrepancy of a few points
    assert np.abs(np.histogram(azimuth, bins=10, range=(0, 360))[0] - 100).max() <= 5
