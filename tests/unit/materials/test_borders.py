"""How far borders stray: of straight, wavy, soft and hidden borders."""

import numpy as np
import pytest

from dav_gswt.materials.borders import measure_bend, measure_fray

CELLS, TILE = 160, 60.0
EVERY = np.ones((CELLS, CELLS), bool)
AWAY = np.broadcast_to(np.arange(CELLS) - CELLS / 2 + 0.5, (CELLS, CELLS))  # from the middle column


def paint(share):
    """Features of two colours that are mixed by a share."""
    return share[..., None] * np.array([10.0, 0.0, 5.0]) + (1 - share[..., None]) * np.array([-10.0, 3.0, 0.0])


def test_a_frayed_border_strays_as_far_as_it_was_moved_and_a_soft_one_counts_as_frayed():
    moved = np.random.default_rng(0).uniform(-6, 6, (CELLS, CELLS))  # a mean distance of 3
    for share, mean in (((moved < AWAY).astype(float), 3), (np.clip(AWAY / 16 + 0.5, 0, 1), 4)):
        assert measure_fray(paint(share), AWAY > 0, EVERY, TILE) == pytest.approx(mean, rel=0.2)


def test_neither_texture_nor_slow_bends_count():
    bend = 15 * np.sin(np.arange(CELLS) / CELLS * 2 * np.pi)[:, None]
    for most, own in ((1, AWAY > 0), (1.2, bend < AWAY)):
        rough = paint(own.astype(float)) + np.random.default_rng(1).normal(0, 10, (CELLS, CELLS, 3))
        assert measure_fray(rough, own, EVERY, TILE) < most


def test_without_a_border_that_is_seen_nothing_is_known_but_equal_colours_give_a_number():
    own = AWAY > 0
    colours = paint(own.astype(float))
    assert measure_fray(colours, own, np.abs(AWAY) > 30, TILE) is None
    assert measure_fray(colours, EVERY, EVERY, TILE) is measure_fray(colours, ~EVERY, EVERY, TILE) is None
    assert measure_bend(EVERY, EVERY, TILE) is None
    assert np.isfinite(measure_fray(paint(np.ones((CELLS, CELLS))), own, EVERY, TILE))


def wave(height, length):
    return height * np.sin(np.arange(CELLS) / length * 2 * np.pi)[:, None] < AWAY


@pytest.mark.parametrize("height", [0.0, 3.0, 6.0])
def test_a_wave_bends_by_the_mean_of_its_height(height):
    # of which the finer filter leaves exp(-2 pi² s² / l²) = .89, the smoother one .17
    assert measure_bend(wave(height, 40.0), EVERY, TILE) == pytest.approx(0.72 * 2 / np.pi * height, rel=0.25)


def test_a_narrow_gap_hides_no_bend_but_a_wide_one_does():
    gap = np.abs(AWAY) > 3
    assert measure_bend(wave(3.0, 40.0), gap, TILE) == measure_bend(wave(3.0, 40.0), EVERY, TILE)
    assert measure_bend(wave(3.0, 40.0), np.abs(AWAY) > 40, TILE) is None
