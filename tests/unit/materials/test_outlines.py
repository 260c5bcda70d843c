from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, label

from dav_gswt.materials import mobilesam, outlines
from dav_gswt.materials.maps import GroundMaps
from dav_gswt.materials.objects import Footprint
from dav_gswt.tiles.layout import Exemplar

M = 64


def disc(row, column, radius):
    rows, columns = np.mgrid[:M, :M]
    return np.hypot(rows - row, columns - column) < radius


SHRUB, STONE = disc(20, 22, 8), disc(20, 36, 5)


@pytest.fixture
def maps():
    """Sand with a green shrub and a grey stone that are a little higher, under noise."""
    noise = np.random.default_rng(0).normal(0, 0.02, (M, M, 3))
    colour = np.where(SHRUB[..., None], [0.2, 0.4, 0.15], [0.8, 0.7, 0.5])
    colour = np.clip(np.where(STONE[..., None], [0.4, 0.4, 0.42], colour) + noise, 0, 1)
    height = 0.3 * (SHRUB | STONE)
    flat, place = np.zeros((M, M)), Exemplar(0.0, 0.0, 0.1, M)
    return GroundMaps(colour, flat, height, flat, np.ones((M, M), bool), place)


def iou(one, two):
    return (one & two).sum() / (one | two).sum()


class Segmenter(mobilesam.Segmenter):
    """Answers prompts with given masks (row 0 in the south), and keeps what it is shown."""

    __setattr__ = object.__setattr__  # not frozen

    def __init__(self, *answers):
        self.answers, self.picture, self.boxes = list(answers), None, []

    def open_picture(self, picture):
        self.picture = picture

        def find(box):
            self.boxes.append(box.tolist())
            cells = self.answers.pop(0)
            return None if cells is None else cells[::-1]

        return find


@pytest.mark.parametrize("before", [disc(20, 22, 5.5), disc(20, 22, 10), disc(22, 20, 8)])
def test_a_cut_finds_the_outline(maps, before):
    (found,) = outlines.refine_footprints(maps, [Footprint(before, 1)])
    assert iou(found.cells, SHRUB) > 0.9 > iou(before, SHRUB) and found.material == 1


def test_a_cut_depends_on_height_where_colours_agree_and_where_heights_do_too_the_footprint_stays(maps):
    flat = replace(maps, colour=np.full((M, M, 3), 0.5))
    (found,) = outlines.refine_footprints(flat, [Footprint(disc(21, 21, 7), 0)])
    assert iou(found.cells, SHRUB) > 0.9
    before = disc(20, 22, 6)
    (found,) = outlines.refine_footprints(replace(flat, surface=np.zeros((M, M))), [Footprint(before, 0)])
    assert iou(found.cells, before) >= outlines.LEAST_AGREEMENT


def test_footprints_never_overlap_and_keep_their_order(maps):
    first, second = Footprint(disc(20, 22, 7), 0), Footprint(disc(20, 36, 4), 1)
    found = outlines.refine_footprints(maps, [first, second])
    assert not (found[0].cells & found[1].cells).any() and [each.material for each in found] == [0, 1]
    both = SHRUB | binary_dilation(STONE, iterations=3)
    found = outlines.refine_footprints(maps, [first, second], Segmenter(both, both))
    assert not (found[0].cells & found[1].cells).any()


def test_the_segmenter_is_shown_the_map_and_the_box_with_north_up(maps):
    segmenter = Segmenter(SHRUB)
    (found,) = outlines.refine_footprints(maps, [Footprint(disc(20, 22, 6.5), 0)], segmenter)
    assert (segmenter.picture == maps.colour[::-1]).all()
    (box,) = segmenter.boxes
    first_column, first_row, end_column, end_row = box
    assert (first_column, end_column) == (15, 30) and (M - end_row, M - first_row) == (13, 28)
    assert (found.cells == SHRUB).all()


@pytest.mark.parametrize("answer", [None, disc(50, 50, 6), disc(20, 22, 18), disc(20, 22, 3)])
def test_a_mask_that_disagrees_leaves_the_footprint_as_it_is(maps, answer):
    before = disc(20, 22, 7)
    (found,) = outlines.refine_footprints(maps, [Footprint(before, 0)], Segmenter(answer))
    assert (found.cells == before).all()


def test_an_outline_is_one_piece_without_holes_on_known_ground_off_the_border(maps):
    (found,) = outlines.refine_footprints(maps, [Footprint(disc(8, 22, 6), 0)], Segmenter(disc(7, 22, 8)))
    assert not found.cells[: outlines.BORDER].any() and found.cells[outlines.BORDER].any()
    answer = (SHRUB & ~disc(20, 22, 2)) | disc(50, 50, 4)
    known = maps.known.copy()
    known[:, :17] = False
    maps = replace(maps, known=known)
    (found,) = outlines.refine_footprints(maps, [Footprint(disc(20, 22, 7) & known, 0)], Segmenter(answer))
    assert (found.cells == SHRUB & known).all() and label(found.cells)[1] == 1


def test_a_footprint_of_two_objects_is_parted(maps):
    both = disc(20, 22, 8) | disc(20, 36, 6)
    found = outlines.refine_footprints(maps, [Footprint(both, 1)], Segmenter(SHRUB, STONE))
    assert [iou(each.cells, true) > 0.95 for each, true in zip(found, (SHRUB, STONE), strict=True)] == [True, True]
    assert found[1].material == 1
    found = outlines.refine_footprints(maps, [Footprint(both, 1)], Segmenter(SHRUB, None))
    assert len(found) == 1


def test_nothing_is_asked_where_there_is_no_object_and_a_few_cells_are_not_cut(maps):
    segmenter, before = Segmenter(), disc(20, 22, 1.5)
    assert outlines.refine_footprints(maps, [], segmenter) == [] and segmenter.picture is None
    (found,) = outlines.refine_footprints(maps, [Footprint(before, 0)])
    assert (found.cells == before).all()
