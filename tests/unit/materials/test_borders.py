"""How far borders stray: of straight, wavy, soft and hidden borders."""

import numpy as np
import pytest

from dav_gswt.materials.borders import measure_bend, measure_fray

CELLS, TILE = 160, 60.0
EVERY = np.ones((CELLS, CELLS), bool)


def paint(share):
    """Features of two colours that are mixed by a share."""
    return share[..., None] * np.array([10.0, 0.0, 5.0]) + (1 - share[..., None]) * np.array([-10.0, 3.0, 0.0])


def away_from_middle():
    return np.broadcast_to(np.arange(CELLS) - CELLS / 2 + 0.5, (CELLS, CELLS))


def test_a_straight_border_strays_by_less_than_a_cell():
    own = away_from_middle() > 0
    assert measure_fray(paint(own.astype(float)), own, EVERY, TILE) < 1


@pytest.mark.parametrize("far", [2.0, 4.0])
def test_a_frayed_border_strays_as_far_as_it_was_moved(far):
    moved = np.random.default_rng(0).uniform(-2 * far, 2 * far, (CELLS, CELLS))  # a mean distance of `far`
    share = (away_from_middle() > moved).astype(float)
    assert measure_fray(paint(share), away_from_middle() > 0, EVERY, TILE) == pytest.approx(far, rel=0.2)


def test_a_soft_border_counts_as_a_frayed_one():
    share = np.clip(away_from_middle() / 16 + 0.5, 0, 1)
    assert measure_fray(paint(share), away_from_middle() > 0, EVERY, TILE) == pytest.approx(4, rel=0.2)


def test_texture_does_not_count():
    own = away_from_middle() > 0
    rough = paint(own.astype(float)) + np.random.default_rng(1).normal(0, 10, (CELLS, CELLS, 3))
    assert measure_fray(rough, own, EVERY, TILE) < 1


def test_slow_bends_do_not_count():
    bend = 15 * np.sin(np.arange(CELLS) / CELLS * 2 * np.pi)[:, None]
    own = away_from_middle() > bend
    assert measure_fray(paint(own.astype(float)), own, EVERY, TILE) < 1.2


def test_of_a_border_that_is_hidden_nothing_is_known():
    own = away_from_middle() > 0
    assert measure_fray(paint(own.astype(float)), own, np.abs(away_from_middle()) > 30, TILE) is None


@pytest.mark.parametrize("own", [EVERY, ~EVERY])
def test_ground_of_one_material_has_no_border(own):
    assert measure_fray(paint(own.astype(float)), own, EVERY, TILE) is None


def test_equal_colours_give_a_finite_number():
    own = away_from_middle() > 0
    assert np.isfinite(measure_fray(paint(np.ones((CELLS, CELLS))), own, EVERY, TILE))


def wave(height, length):
    return away_from_middle() > height * np.sin(np.arange(CELLS) / length * 2 * np.pi)[:, None]


def test_a_straight_border_does_not_bend():
    assert measure_bend(away_from_middle() > 0, EVERY, TILE) == 0


@pytest.mark.parametrize("height", [3.0, 6.0])
def test_a_wave_bends_by_the_mean_of_its_height(height):
    # of which the finer filter leaves exp(-2 pi² s² / l²) = .89, the smoother one .17
    assert measure_bend(wave(height, 40.0), EVERY, TILE) == pytest.approx(0.72 * 2 / np.pi * height, rel=0.25)


def test_a_narrow_gap_hides_no_bend_but_a_wide_one_does():
    gap = np.abs(away_from_middle()) > 3
    assert measure_bend(wave(3.0, 40.0), gap, TILE) == measure_bend(wave(3.0, 40.0), EVERY, TILE)
    assert measure_bend(wave(3.0, 40.0), np.abs(away_from_middle()) > 40, TILE) is None


def test_of_ground_without_a_border_no_bend_is_known():
    assert measure_bend(EVERY, EVERY, TILE) is None
