import numpy as np
import pytest

from dav_gswt.materials import strips

K = 200
ROWS, COLUMNS = np.mgrid[:K, :K]


def test_a_winding_path_that_is_found_twice_counts_once():
    path = np.abs(COLUMNS - 100 - 30 * np.sin(ROWS / 35)) < 8
    (found,) = strips.find_strips([path.astype(int), 2 * path.astype(int)])
    assert (found & path).sum() > 0.95 * path.sum()


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
        np.zeros((K, K), bool),
    ],
)
def test_other_ground_is_none(cells):
    assert strips.find_strips([cells.astype(int)]) == []


@pytest.mark.parametrize(("own", "transition"), [(0.5, True), (0.0, True), (-1.0, False), ("other", False)])
def test_a_mixture_of_both_sides_is_a_transition(own, transition):
    one, two, other = np.array([40.0, 0, 0]), np.array([60.0, 20, 10]), np.array([50.0, -10, 20])
    labels = (COLUMNS > 100).astype(int)
    strip = np.abs(COLUMNS - 100) < 8
    colours = np.where(labels[..., None] == 1, two, one)
    colours[strip] = other if own == "other" else one + own * (two - one)
    assert strips.is_transition(strip, colours, labels) == transition


def test_a_few_bright_things_make_no_strip_of_the_ground_between_them():
    ground, bright = np.array([30.0, 0, 10]), np.array([40.0, -3, -5])
    colours = np.broadcast_to(ground, (K, K, 3)).copy()
    strip = np.abs(COLUMNS - 100) < 8
    colours[strip & (ROWS % 10 < 4)] = bright
    assert strips.is_transition(strip, colours, np.zeros((K, K), int))
