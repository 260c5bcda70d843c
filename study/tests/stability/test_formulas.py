from dataclasses import replace

import numpy as np
import pytest

from dav_gswt_study.stability import formula, registry
from dav_gswt_study.stability.formula import Case, Check

DESCRIPTIONS = registry.read_descriptions()


@pytest.mark.parametrize("group", dict.fromkeys(about["group"] for about in DESCRIPTIONS))
def test_the_formulas_of_a_group_stay_within_their_tolerances(group):
    rows = [registry.measure_formula(about) for about in DESCRIPTIONS if about["group"] == group]
    assert {row["formula"]: row["worst_at"] for row in rows if not row["finite"] or row["share_of_tolerance"] > 1} == {}


def test_the_printed_or_naive_forms_do_not():
    printed = [check for check in registry.CHECKS.values() if check.printed]
    assert printed
    for check in printed:
        assert formula.measure_error(check, check.printed).share > 1000, check.name


def make_check(compute, relative=1e-5, absolute=1e-3):
    x = np.array([0.0, 1.0, 4.0])
    cases = [Case("x = ", (x,), x), Case("a large one", (np.array([1e6]),))]
    return Check("double", lambda: cases, compute, lambda x: 2 * x, relative, absolute)


def test_the_worst_place_is_the_one_nearest_to_its_tolerance():
    broken = formula.measure_error(make_check(compute := lambda x: 2 * x + np.where(x == 4, 0.1, 0.01)), compute)
    assert broken.label == "x = 4" and (broken.computed, broken.expected) == (8.1, 8)
    assert broken.share == pytest.approx(0.1 / (1e-3 + 8e-5)) and broken.absolute == pytest.approx(0.1)
    assert broken.relative == pytest.approx(0.1 / 8)  # errors of values near 0 do not count


def test_what_is_not_finite_exceeds_every_tolerance_and_equal_numbers_are_no_error_without_any():
    for bad in (np.nan, np.inf):
        found = formula.measure_error(make_check(lambda x: x), lambda x, bad=bad: np.where(x == 1, bad, 2 * x))
        assert not found.finite and found.share == np.inf and found.label == "x = 1"
    exact = make_check(lambda x: 2 * x, 0.0, 0.0)
    assert formula.measure_error(exact, exact.compute).share == 0
    assert formula.measure_error(replace(exact, reference=lambda x: x), exact.compute).share == np.inf
