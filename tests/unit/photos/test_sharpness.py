"""Blurred photos are found by their detail, whatever they show."""

import numpy as np
import pytest
from fixtures import photos as synth
from scipy.ndimage import gaussian_filter, uniform_filter1d

from dav_gswt.images import image_files
from dav_gswt.photos.photo_files import find_blurred


def smear(image, axis):
    return uniform_filter1d(image, 9, axis=axis)


@pytest.mark.parametrize(
    "blur", [lambda i: smear(i, 0), lambda i: smear(i, 1), lambda i: gaussian_filter(i, (2.5, 2.5, 0))]
)
def test_the_blurred_photo_is_found_among_sharp_ones_of_other_brightness_and_contrast(tmp_path, blur):
    rng = np.random.default_rng(0)
    paths = [tmp_path / f"{i}.png" for i in range(6)]
    for i, path in enumerate(paths):
        image = gaussian_filter(rng.random((200, 260, 3)), (0.7, 0.7, 0)) * (0.1 + 0.15 * i) + 0.02 * i
        image_files.write_png(path, blur(image) if i == 4 else image)
    assert find_blurred(paths, 1).tolist() == find_blurred(paths, 2).tolist() == [i == 4 for i in range(6)]


def test_sharp_photos_of_a_flight_are_not_blurred(tmp_path):
    synth.shoot(tmp_path, synth.flight(2, 3), synth.texture(np.random.default_rng(0)), 1.4)
    assert not find_blurred(sorted(tmp_path.glob("*.png")), 1).any()
