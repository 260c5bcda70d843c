import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.materials import maps


@pytest.fixture
def draw(tmp_path):
    def draw(name, cells):
        image_files.write_png(tmp_path / f"{name}.png", np.repeat(cells.astype(float)[..., None], 3, 2))
        return tmp_path / f"{name}.png"

    return draw


def north(size=64, rows=16):
    cells = np.zeros((size, size))
    cells[:rows] = 1
    return cells


def test_masks_of_any_size_are_read_north_up(draw):
    masks = maps.read_masks({"lawn": draw("lawn", north()), "exclude": draw("out", north()[::-1])}, 32)
    assert masks.materials["lawn"][24:].all() and not masks.materials["lawn"][:24].any()
    assert masks.excluded[:8].all() and not masks.excluded[8:].any()


def test_the_first_of_two_that_overlap_counts_larger_ones_come_first_and_other_cells_have_none(draw):
    files = {"small": draw("small", north(rows=16)), "large": draw("large", north(rows=48))}
    labels, names = maps.read_masks(files | {"exclude": draw("out", north(rows=4))}, 32).label()
    assert names == ["large", "small"]
    wanted = np.repeat([-1, 0, 1, -1], [8, 16, 6, 2])[:, None]
    np.testing.assert_array_equal(labels, np.tile(wanted, 32))


@pytest.mark.parametrize(
    "name, cells, message",
    [
        ("lawn", np.ones((32, 64)), r"a\.png: is 64 x 32 pixels.*ground\.png"),
        ("lawn", np.zeros((32, 32)), r"a\.png: is white nowhere"),
        ("exclude", np.ones((32, 32)), "leave no ground"),
        ("lawn", None, r"a\.png"),
    ],
)
def test_masks_that_are_not_square_or_leave_nothing_and_what_is_no_picture_are_refused(
    draw, tmp_path, name, cells, message
):
    (tmp_path / "a.png").write_text("no picture")
    if cells is not None:
        draw("a", cells)
    with pytest.raises(InputError, match=message):
        maps.read_masks({name: tmp_path / "a.png"}, 32)
