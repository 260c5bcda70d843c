"""Painted places: what a point does to the scores around it, and to what lies there."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import SIDE, two_classes

from dav_gswt.bundle.land_cover import find_run_fault
from dav_gswt.terrain.classes import LATTICE, Classes
from dav_gswt.terrain.painted import Painted, paint_lead

SQUARE = [[-8, j, 24, 1] for j in range(-8, 16)]  # the cell (0, 0) and all around it


def with_paint(runs):
    return Classes(replace(two_classes(), painted=runs), 2, SIDE)


def lattice(low, high):
    i, j = np.mgrid[low:high, low:high].astype(np.int64)
    return i.ravel(), j.ravel()


def test_a_point_has_binomial_weights_around_it():
    i, j = lattice(-3, 4)
    weights = Painted([[0, 0, 1, 1]]).weights_at(i, j, 2)
    row = np.array([0, 1, 4, 6, 4, 1, 0])
    assert (weights[:, 1].reshape(7, 7) == np.outer(row, row)).all() and not weights[:, 0].any()


@pytest.mark.parametrize("shift", [(0, 0), (-8, 3), (8 * 10**5, -17)])
def test_weights_are_those_of_a_sum_over_all_points(shift):
    rng = np.random.default_rng(1)
    points = {(int(i), int(j)): int(m) for i, j, m in rng.integers(0, [20, 20, 3], (150, 3)) + [*shift, 0]}
    i, j = lattice(-4, 24)
    i, j = i + shift[0], j + shift[1]
    expected = np.zeros((len(i), 3), int)
    spread = {-2: 1, -1: 4, 0: 6, 1: 4, 2: 1}
    for (x, y), material in points.items():
        expected[:, material] += [spread.get(a - x, 0) * spread.get(b - y, 0) for a, b in zip(i, j, strict=True)]
    painted = Painted([[x, y, 1, m] for (x, y), m in points.items()])
    assert len(painted) == len(points)
    assert (painted.weights_at(i, j, 3) == expected).all()


def test_inside_paint_nothing_of_another_material_is_left():
    painted, plain = with_paint(SQUARE), with_paint([])
    assert painted.materials_in(np.array([0]), np.array([0])).tolist() == [2]
    means = np.stack([*np.random.default_rng(0).random((2, 300)) * SIDE, np.full(300, 3.0)], 1).astype(np.float32)
    assert painted.keep(0, 0, means, np.ones(300, int)).all()
    assert not painted.keep(0, 0, means, np.zeros(300, int)).any()
    assert plain.keep(0, 0, means, np.zeros(300, int)).any()


def test_three_steps_beyond_paint_scores_are_those_of_the_rule():
    i, j = lattice(-40, 48)
    painted, plain = with_paint(SQUARE).lattice_scores(i, j), with_paint([]).lattice_scores(i, j)
    beyond = np.maximum(np.abs(i - 3.5), np.abs(j - 3.5)) > 11.5 + 2
    assert (painted[beyond] == plain[beyond]).all()
    lead = paint_lead(two_classes())
    inner = np.maximum(np.abs(i - 3.5), np.abs(j - 3.5)) <= 11.5 - 2
    assert (painted[inner] == [-lead, 0]).all()


def test_the_border_of_paint_is_about_as_steep_as_those_of_the_rule():
    """Across a straight edge in the middle of sand: no step of the lattice takes more than 3/8 of the whole change."""
    entry = two_classes()
    entry = replace(entry, rule=[replace(entry.rule[0], biases=[5.0, 0.0])])
    painted = Classes(replace(entry, painted=[[0, j, 40, 1] for j in range(40)]), 2, SIDE)
    i = np.arange(-4, 8)
    scores = painted.lattice_scores(i, np.full(12, 20))
    steps = np.diff(scores[:, 1] - scores[:, 0])[2:]
    assert steps.min() >= 0 and steps.max() == pytest.approx(2 * paint_lead(entry) * 6 / 16)


def test_what_is_painted_moves_with_the_lattice():
    assert with_paint([[LATTICE * 5, -LATTICE, 9, 1]])._painted.weights_at(
        np.array([LATTICE * 5 + 4]), np.array([-LATTICE]), 2
    ).tolist() == [[0, 16 * 6]]


@pytest.mark.parametrize(
    "runs, fault",
    [
        ([[0, 0, 1]], "not four numbers"),
        ([[0, 0, 0, 0]], "beyond the bounds"),
        ([[2**23, 0, 1, 0]], "beyond the bounds"),
        ([[0, -(2**23), 1, 0]], "beyond the bounds"),
        ([[0, 0, 2**18, 0], [0, 1, 1, 0]], "more than 262144 places"),
        ([[0, 0, 1, 2]], "not there"),
        ([[0, 0, 5, 1]], None),
    ],
)
def test_runs_that_make_no_sense_are_named(runs, fault):
    found = find_run_fault(runs, 2)
    assert fault in found if fault else found is None
