"""JPEGs for pages."""

import numpy as np

from dav_gswt.images import image_files
from dav_gswt.images.jpeg import encode_jpeg


def test_colours_stay_and_values_beyond_are_clipped(tmp_path):
    image = np.full((16, 24, 3), [1.5, 0.5, -1.0])
    (tmp_path / "a.jpg").write_bytes(encode_jpeg(image, 90))
    assert abs(image_files.read_photo(tmp_path / "a.jpg") - [1, 0.5, 0]).max() < 0.02
    assert encode_jpeg(image, 90) == encode_jpeg(image, 90)
