import numpy as np
import pytest

from dav_gswt.geometry import camera_layouts, cameras


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


def camera(elevation, azimuth, radius=7.0, target=(1.0, 2.0, 0.5)):
    return camera_layouts.orbit(elevation, azimuth, radius, target, 60, 40, 90.0)
