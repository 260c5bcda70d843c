from itertools import combinations

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


def test_large_maps_are_averaged_and_their_classes_enlarged(monkeypatch):
    monkeypatch.setattr(segmentation, "WORKING_SIZE", 50)
    colour, true = made.maps(shrubs=False).colour, made.true_materials()
    np.testing.assert_allclose(segmentation._shrink(colour)[1, 2], colour[3:6, 6:9].mean((0, 1)))
    labels = segment(colour)
    assert labels.shape == true.shape and (labels == true).mean() > 0.93


def test_a_picture_of_one_colour_and_even_ground_are_one_class_without_strips_although_light_fades():
    assert segment(np.zeros((64, 64, 3))).max() == 0
    colour = made.maps(mixed=False, shrubs=False).colour
    labels, crossing = next(
        segmentation.list_segmentations(colour * np.linspace(1.0, 0.55, len(colour))[None, :, None])
    )
    assert labels.max() == 0 and crossing == []


def test_a_few_white_stones_change_no_other_feature():
    rng = np.random.default_rng(0)
    dark = rng.uniform(0.15, 0.25, (96, 96, 3))
    stony = dark.copy()
    stony[:24, :24] = 0.95  # 6 % of all
    plain, beside = segmentation.describe_cells(dark), segmentation.describe_cells(stony)
    # before, the stones' brightness was taken for that of all: dark ground had .35 of its contrast
    assert beside[48:, 48:, 3].mean() > 0.6 * plain[48:, 48:, 3].mean()


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


def test_a_strip_that_one_start_of_many_sets_apart_is_found(monkeypatch):
    rng = np.random.default_rng(3)
    colour = np.array([0.5, 0.45, 0.4]) + 0.02 * rng.normal(size=(128, 128, 1))
    path = np.abs(np.arange(128) - 60) < 4
    colour[:, path] += np.array([0.15, 0.02, -0.1])
    apart = np.broadcast_to(path.astype(int), (128, 128))
    halves = np.broadcast_to((np.arange(128) > 60).astype(int), (128, 128))
    monkeypatch.setattr(segmentation, "_cluster", lambda _, start: apart if start == 1 else halves)
    monkeypatch.setattr(segmentation, "_explained_variance", lambda _, labels: float(not np.array_equal(labels, apart)))
    (found,) = next(segmentation.list_segmentations(colour))[1]
    assert found[:, path].mean() > 0.9 and found.mean() < 1.7 * path.mean()


def test_each_merger_is_the_cheapest_of_all_that_are_allowed():
    features = segmentation.describe_cells(made.maps(shrubs=False).colour[:96, :96])
    trace = segmentation.merge_clusters(features, np.arange(96 * 96).reshape(96, 96) // 1024)
    assert len(trace) > 3
    for before, after in zip(trace, trace[1:], strict=False):
        pairs = [
            segmentation.compare_classes(features, before, a, b) for a, b in combinations(range(before.max() + 1), 2)
        ]
        alike = [each for each in pairs if each.is_small] or [each for each in pairs if each.is_gradual]
        best = min(alike, key=lambda each: each.cost)
        merged = np.where(before == best.second, best.first, before)
        assert np.array_equal(after, merged - (merged > best.second))
    assert np.isfinite(segmentation._negative_log_likelihood(features, features[:1, 0])).all()  # of one cell, too


K = 200
ROWS, COLUMNS = np.mgrid[:K, :K]
NOISE = gaussian_filter(np.random.default_rng(0).normal(size=(K, K)), 8)


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
        np.quantile(NOISE, 2 / 3) < NOISE,  # branched, over a third of the ground
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
