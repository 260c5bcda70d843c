"""What a prior is given of the photos: squares from the middle of pictures."""

import numpy as np
import pytest

from dav_gswt.geometry.cameras import pinhole
from dav_gswt.prior.interface import crop_camera, crop_image


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
