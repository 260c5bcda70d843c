"""Names of the pictures that are made of photos."""

import pytest

from dav_gswt.photos.picture_names import name_pictures


@pytest.mark.parametrize(
    ("names", "pictures"),
    [
        (["a.jpg", "a.png", "b.jpg"], ["a_jpg.png", "a_png.png", "b.png"]),
        (["a.jpg", "a.png", "a_png.jpg"], ["a_jpg.png", "a_png.png", "a_png_2.png"]),
        (["one/a.jpg", "two/a.jpg"], ["one_a_jpg.png", "two_a_jpg.png"]),
        (["a b.jpg", "a_b.jpg", "#1\t.jpg"], ["a_b_jpg.png", "a_b_jpg_2.png", "_1_.png"]),
        (["flight.2024.jpg"], ["flight.2024.png"]),
    ],
)
def test_every_photo_has_a_name_of_its_own_in_one_word(names, pictures):
    assert name_pictures(names) == pictures
