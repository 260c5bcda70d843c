import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.materials import mask_images


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
    masks = mask_images.read_masks({"lawn": draw("lawn", north()), "exclude": draw("out", north()[::-1])}, 32)
    assert masks.materials["lawn"][24:].all() and not masks.materials["lawn"][:24].any()
    assert masks.excluded[:8].all() and not masks.excluded[8:].any()


def test_the_first_of_two_that_overlap_counts_and_larger_ones_come_first(draw):
    files = {"small": draw("small", north(rows=16)), "all": draw("all", np.ones((64, 64)))}
    labels, names = mask_images.read_masks(files, 32).label()
    assert names == ["all", "small"]
    assert (labels[24:] == 1).all() and (labels[:24] == 0).all()


def test_cells_without_a_name_have_none(draw):
    labels, _ = mask_images.read_masks({"lawn": draw("lawn", north())}, 32).label()
    assert (labels[:24] == -1).all()


def test_a_mask_that_is_not_square_is_refused(draw):
    with pytest.raises(InputError, match=r"wide\.png: is 64 x 32 pixels.*ground\.png"):
        mask_images.read_masks({"lawn": draw("wide", np.ones((32, 64)))}, 32)


def test_a_black_mask_is_refused(draw):
    with pytest.raises(InputError, match=r"black\.png: is white nowhere"):
        mask_images.read_masks({"lawn": draw("black", np.zeros((32, 32)))}, 32)


def test_masks_that_leave_nothing_are_refused(draw):
    with pytest.raises(InputError, match="leave no ground"):
        mask_images.read_masks({"exclude": draw("out", np.ones((32, 32)))}, 32)


def test_a_file_that_is_no_picture_is_refused(tmp_path):
    (tmp_path / "lawn.png").write_text("no picture")
    with pytest.raises(InputError, match=r"lawn\.png"):
        mask_images.read_masks({"lawn": tmp_path / "lawn.png"}, 32)
