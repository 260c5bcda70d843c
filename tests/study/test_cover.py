import numpy as np
import pytest

from dav_gswt.images import image_files
from dav_gswt.study import cover


def write(path, colour, shape):
    image_files.write_png(path, np.broadcast_to(np.float32(colour), (*shape, 3)))
    return path


def test_photos_stand_in_a_row_above_the_terrain(tmp_path):
    colours = [[0.9, 0.1, 0.1], [0.1, 0.9, 0.1]]
    photos = [write(tmp_path / f"{k}.png", colour, (900, 1200)) for k, colour in enumerate(colours)]
    cover.draw_cover(photos, write(tmp_path / "still.png", [0.1, 0.1, 0.9], (1080, 1920)), tmp_path / "c.jpg")
    picture = image_files.read_photo(tmp_path / "c.jpg")
    assert picture.shape[1] == cover.WIDTH
    for row, column, channel in ((100, 200, 0), (100, 1000, 1), (900, 600, 2)):
        assert picture[row, column].argmax() == channel


def test_photos_of_any_shape_fill_their_place():
    row = cover.arrange_photos(
        [np.full((400, 1600, 3), 0.2), np.full((1600, 400, 3), 0.2), np.full((800, 800, 3), 0.2)]
    )
    assert row.shape[1] == cover.WIDTH
    assert (row < 0.5).mean() > 0.98


def test_without_photos_there_is_no_row():
    with pytest.raises(ValueError, match="no photos"):
        cover.arrange_photos([])
