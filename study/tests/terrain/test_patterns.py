import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dav_gswt.errors import InputError
from dav_gswt_study.terrain import patterns, regular

PIXELS = 16  # a tile; the exemplar is four tiles wide
SIZE = 4 * PIXELS


@pytest.fixture(scope="module")
def brick_levels():
    return regular.make_brick()


def noise(seed, size, width=3.0):
    rough = np.random.default_rng(seed).normal(size=(size, size))
    return gaussian_filter(rough, width, mode="wrap") - 0.5 * gaussian_filter(rough, 3 * width, mode="wrap")


def test_octaves_reach_from_half_the_exemplar_to_half_a_tile_and_ground_of_one_kind_has_ratios_of_one():
    own, there = noise(0, SIZE), noise(1, 20 * PIXELS)
    octaves = patterns.compare_spectra((there, there), own, PIXELS)
    assert [(o.shortest, o.longest) for o in octaves] == [(1, 2), (0.5, 1)]
    assert all(0.5 < o.ratio < 2 for o in octaves)
    slope = np.linspace(0, 5, SIZE)  # wider than a crop: counts on neither side
    dull = patterns.compare_spectra((there / 2, there), own + slope, PIXELS)
    for before, after in zip(octaves, dull, strict=True):
        assert after.ways == pytest.approx((before.ways[0] / 4, before.ways[1]))
        assert after.ratio == pytest.approx(before.ratio / 2) and after.halves == pytest.approx(before.halves)


def test_a_wave_lies_in_its_own_octave():
    wave = np.sin(2 * np.pi * np.arange(SIZE) * 6 / SIZE) * np.ones((SIZE, 1))
    power = patterns.measure_power(wave, SIZE)
    assert np.argmax(power) == 2 and power[2] > 0.95 * power.sum()  # 4 to 8 periods
    assert patterns.measure_power(3 * wave, SIZE).sum() == pytest.approx(9 * power.sum())


CELLS = 8  # a side of a tile


def one_landmark(chosen, label=0):
    """A landmark of 2 x 2 cells in a tile set of two tiles, of which the second does not show it."""
    numbers = np.zeros((24, 24), int)
    numbers[10:12, 10:12], numbers[20:22, 3:6] = 1, 2
    labels, shifts = np.full((2, CELLS, CELLS), label, np.uint8), np.zeros((2, 9, 2), int)
    shifts[0] += 8
    return patterns.measure_landmarks(patterns.Landmarks("", numbers), labels, shifts, chosen)


def test_copies_are_as_far_apart_as_the_tiles_that_show_them():
    side = 2 * patterns.AROUND + 12
    chosen = np.ones((side, side), int)
    chosen[::3, ::2] = 0
    found = one_landmark(chosen)
    assert (found.count, found.distance, found.in_strips) == (2, 2.0, 0.0) and found.copies == 4 * 6
    assert found.shown == pytest.approx(4 / 10)
    assert one_landmark(chosen, label=3).in_strips == 1.0
    assert np.isnan(one_landmark(np.ones((side, side), int)).distance)


def test_a_landmark_in_one_of_many_tiles_returns_after_as_far_as_chance_says():
    labels, shifts = np.zeros((32, CELLS, CELLS), np.uint8), np.zeros((32, 9, 2), int)
    shifts[0] += 8
    numbers = np.zeros((24, 24), int)
    numbers[10:12, 10:12] = 1
    chosen = np.random.default_rng(0).integers(32, size=(200, 200))
    found = patterns.measure_landmarks(patterns.Landmarks("", numbers), labels, shifts, chosen)
    assert found.distance == pytest.approx(0.47 * 32**0.5, rel=0.15)


def test_a_landmark_that_a_border_parts_is_one_copy():
    """Both tiles show half of it, at one place of the terrain."""
    numbers = np.zeros((24, 24), int)
    numbers[10:12, 6:10] = 1
    labels = np.zeros((3, CELLS, CELLS), np.uint8)
    shifts = np.array([[0, 8], [8, 8], [100, 100]])[:, None] * np.ones((1, 9, 1), int)
    shifts[2] = [16, 0]  # shows no landmark
    side = 2 * patterns.AROUND + 8
    chosen = np.full((side, side), 2)
    chosen[::4, ::4], chosen[::4, 1::4] = 0, 1
    found = patterns.measure_landmarks(patterns.Landmarks("", numbers), labels, shifts, chosen)
    assert (found.distance, found.copies, found.shown) == (4.0, 4, 1.0)


def test_landmarks_are_those_of_one_exemplar_and_come_back_from_disk(brick_levels, tmp_path):
    found = patterns.find_landmarks(brick_levels)
    assert found.areas.size and found.areas.min() >= patterns.LEAST * np.pi * (0.4 * regular.CELLS / 24) ** 2
    assert set(np.unique(found.numbers)) == set(range(len(found.areas) + 1))
    patterns.write_landmarks([found], tmp_path / "marks.json")
    (back,) = patterns.read_landmarks(tmp_path / "marks.json", [brick_levels])
    np.testing.assert_array_equal(back.numbers, found.numbers)
    with pytest.raises(InputError, match="another exemplar"):
        patterns.read_landmarks(tmp_path / "marks.json", [regular.make_furrows()])


@pytest.fixture(scope="module")
def brick(brick_levels):
    return patterns.picture_exemplar(brick_levels, 0.4 * 512 * regular.SPACING, 96)


def test_brick_and_furrows_have_the_periods_that_they_were_made_with(brick):
    pixel = 512 / len(brick)
    length, height = regular.BRICK
    found = patterns.find_periods(patterns.correlate_local(brick, len(brick))) * pixel
    turn = np.radians(regular.BRICK_TURN)
    found = found @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    np.testing.assert_allclose(np.abs(found), [[length / 2, height]] * 2, atol=0.6)
    furrows = patterns.picture_exemplar(regular.make_furrows(), 0.4 * 512 * regular.SPACING, 96)
    first = patterns.find_periods(patterns.correlate_local(furrows, len(furrows)))[0] * pixel
    across = np.radians(regular.FURROW_TURN)
    assert abs(first @ [-np.sin(across), np.cos(across)]) == pytest.approx(regular.FURROW, abs=0.6)


def test_rows_that_go_on_keep_their_correlation_even_turned_and_rows_that_break_lose_it(brick):
    half = brick[:96, :96]
    kept = patterns.compare_regularity(np.rot90(brick), brick)
    rng = np.random.default_rng(0)
    cuts = [np.concatenate([np.roll(half, rng.integers(96, size=2), (0, 1)) for _ in range(6)], 1) for _ in range(6)]
    broken = patterns.compare_regularity(np.concatenate(cuts), brick)
    assert kept.ratio > 0.95 and broken.ratio < 0.6
    plain = noise(0, 200)
    assert not len(patterns.find_periods(patterns.correlate_local(plain, 200)))


def test_lines_at_borders_are_jumps_and_others_are_the_floor():
    picture = noise(0, 20 * PIXELS, 1.0)
    lines = PIXELS * np.arange(1.0, 20)
    even = patterns.measure_jump(picture, lines, lines)
    assert even.jump == pytest.approx(even.floor, abs=4 * even.deviation) and even.floor == pytest.approx(1, abs=0.03)
    picture[:, lines.astype(int)] += 0.5
    assert patterns.measure_jump(picture, lines, lines).jump > 1.5
