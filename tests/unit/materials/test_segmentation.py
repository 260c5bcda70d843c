import numpy as np
import pytest
from fixtures import mixed_ground as made
from scipy.ndimage import gaussian_filter

from dav_gswt.materials import segmentation, strips


def segment(colour):
    """Classes alone."""
    return next(segmentation.list_segmentations(colour))[0]


def test_two_materials_are_told_apart_and_numbered_by_their_share():
    colour, true = made.maps(shrubs=False).colour, made.true_materials()
    labels = segment(colour)
    assert (labels == true).mean() > 0.95  # a strip along the border may be a class of its own
    assert (np.diff(np.bincount(labels.ravel())) <= 0).all()
    np.testing.assert_array_equal(segment(0.5 * colour), labels)  # in another exposure, too


def test_a_picture_of_one_colour_and_even_ground_are_one_class_without_strips_although_light_fades():
    assert segment(np.zeros((64, 64, 3))).max() == 0
    colour = made.maps(mixed=False, shrubs=False).colour
    labels, crossing = next(
        segmentation.list_segmentations(colour * np.linspace(1.0, 0.55, len(colour))[None, :, None])
    )
    assert labels.max() == 0 and crossing == []


def test_grain_alone_can_make_a_class():
    """Rough and smooth ground of one mean colour."""
    rng = np.random.default_rng(0)
    grain = gaussian_filter(rng.normal(0, 1, (128, 128)), 0.7)
    amplitude = np.where(np.arange(128) < 64, 0.02, 0.5)[:, None]
    colour = np.clip(0.5 + (amplitude * grain)[..., None] * np.ones(3), 0, 1)
    labels = segment(colour)
    assert (labels[10:54] != labels[74:118]).mean() > 0.95


def test_a_path_is_a_strip_of_its_own():
    colour = made.maps(mixed=False, shrubs=False).colour.copy()
    rows, columns = np.mgrid[: len(colour), : len(colour)]
    path = np.abs(columns - 60 - 12 * np.sin(rows / 20)) < 4
    rng = np.random.default_rng(3)
    colour[path] = np.array([0.52, 0.44, 0.36]) + 0.02 * rng.normal(size=(path.sum(), 1))
    (strip,) = next(segmentation.list_segmentations(np.clip(colour, 0, 1)))[1]
    assert (strip & path).sum() > 0.9 * path.sum() and strip.sum() < 1.7 * path.sum()


K = 200
ROWS, COLUMNS = np.mgrid[:K, :K]
NOISE = gaussian_filter(np.random.default_rng(0).normal(size=(K, K)), 8)


def test_a_fork_of_roads_is_found_whole_also_with_something_lying_across():
    road = (np.abs(ROWS - 150) < 7) | ((np.abs(COLUMNS - 90) < 7) & (ROWS < 150))
    across = (np.abs(COLUMNS - 60) < 4) | (np.abs(ROWS - 80) < 4)
    for cells in (road, road & ~across):
        (found,) = strips.find_strips([cells.astype(int)])
        assert (found & road).sum() > 0.9 * road.sum()


@pytest.mark.parametrize(
    "cells",
    [
        np.hypot(ROWS - 100, COLUMNS - 100) < 60,  # round
        np.abs(COLUMNS - 100) < 30,  # as wide as a material
        (np.abs(COLUMNS - 100) < 8) & (np.abs(ROWS - 100) < 50),  # short
        np.abs(COLUMNS - 100) < 2,  # a thread
        (COLUMNS // 25) % 2 == 0,  # one of many
        COLUMNS % 50 < 8,  # the same, far apart
        ((ROWS % 24 < 9) | (COLUMNS % 24 < 9)) & (ROWS > 60),  # a net
        np.quantile(NOISE, 2 / 3) < NOISE,  # branched, over a third of the ground
        np.zeros((K, K), bool),
    ],
)
def test_other_ground_is_none(cells):
    assert strips.find_strips([cells.astype(int)]) == []
