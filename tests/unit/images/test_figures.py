import numpy as np
import pytest

from dav_gswt.images import figures, image_files
from dav_gswt.images.figures import encode_jpeg


@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_a_picture_is_kept_as_its_ending_says(tmp_path, ending):
    picture = np.tile(np.linspace(0, 1, 64, dtype=np.float32)[:, None, None], (1, 48, 3))
    image_files.write_png(tmp_path / "a.png", picture)
    figures.copy_figure(tmp_path / "a.png", tmp_path / f"b{ending}")
    assert (tmp_path / f"b{ending}").read_bytes()[:3] == {".png": b"\x89PN", ".jpg": b"\xff\xd8\xff"}[ending]
    np.testing.assert_allclose(image_files.read_photo(tmp_path / f"b{ending}"), picture, atol=0.02)


def test_a_sheet_shows_every_picture_in_its_row(tmp_path):
    """Two rows of two: each quarter has the colour of its own picture."""
    colours = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]], np.float32)
    for number, colour in enumerate(colours):
        image_files.write_png(tmp_path / f"{number}.png", np.broadcast_to(colour, (40, 80, 3)))
    rows = {name: [tmp_path / f"{k + n}.png" for n in (0, 1)] for k, name in ((0, "upper"), (2, "lower"))}
    figures.save_figure(figures.draw_sheet(rows, ["left", "right"], tall=1.0), tmp_path / "sheet.png")
    shown = image_files.read_photo(tmp_path / "sheet.png")
    high, wide = (n // 4 for n in shown.shape[:2])
    found = [shown[y * high, x * wide] for y in (1, 3) for x in (1, 3)]
    np.testing.assert_allclose(found, colours, atol=0.02)
    assert shown.shape[1] > 1.8 * shown.shape[0]


def test_colours_of_a_jpeg_stay_and_values_beyond_are_clipped(tmp_path):
    image = np.full((16, 24, 3), [1.5, 0.5, -1.0])
    (tmp_path / "a.jpg").write_bytes(encode_jpeg(image, 90))
    assert abs(image_files.read_photo(tmp_path / "a.jpg") - [1, 0.5, 0]).max() < 0.02
    assert encode_jpeg(image, 90) == encode_jpeg(image, 90)
