"""Holes filled by cells of the source, and masks that say what is what."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.materials import maps
from dav_gswt.materials.extraction import fill_cells
from dav_gswt.tiles import energy


def stripes(m=48):
    """Stripes of two cells along x, with a little grain."""
    rng = np.random.default_rng(3)
    bright = 0.3 + 0.4 * (np.arange(m) // 2 % 2)
    return np.repeat(np.broadcast_to(bright[:, None], (m, m))[..., None], 3, -1) + rng.normal(0, 0.01, (m, m, 1))


def fill(colour, source, patch=8):
    terms = energy.SeamEnergy("colour", 0.0, energy.make_colour_layer(colour), None).terms(1.0)
    return fill_cells(colour, terms, source, patch, np.random.default_rng(0))


def hole(m=48):
    source = np.ones((m, m), bool)
    source[14:33, 10:36] = False
    return source


def test_a_regular_ground_goes_on_through_the_hole_with_cells_of_the_source_and_the_rest_stays():
    colour, source = stripes(), hole()
    found, again = (fill(colour, source) for _ in range(2))
    off = np.abs(colour[found.rows, found.columns] - colour)[~source]
    assert off.mean() < 0.02  # grain alone is 0.011; a stripe out of step 0.4
    assert source[found.rows, found.columns].all() and not found.copied[:4].any()
    np.testing.assert_array_equal([found.rows, found.columns], [again.rows, again.columns])


def test_a_full_source_stays_patches_shrink_to_what_a_narrow_one_holds_and_without_room_none_is_placed():
    assert not fill(stripes(), np.ones((48, 48), bool)).copied.any()
    source = np.zeros((48, 48), bool)
    source[20:26] = True
    found = fill(stripes(), source, patch=16)
    assert source[found.rows, found.columns].all()
    source[23:] = False
    assert fill(stripes(), source) is None


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
