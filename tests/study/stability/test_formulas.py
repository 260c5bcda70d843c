"""Every formula stays within its tolerance over its whole range, and a wrong one is noticed."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.study.stability import formula, registry
from dav_gswt.study.stability.formula import Case, Check

DESCRIPTIONS = registry.read_descriptions()
GROUPS = list(dict.fromkeys(about["group"] for about in DESCRIPTIONS))
PRINTED = [check for check in registry.CHECKS.values() if check.printed]


@pytest.mark.parametrize("group", GROUPS)
def test_the_formulas_of_a_group_stay_within_their_tolerances(group):
    rows = [registry.measure_formula(about) for about in DESCRIPTIONS if about["group"] == group]
    assert {row["formula"]: row["worst_at"] for row in rows if not row["finite"] or row["share_of_tolerance"] > 1} == {}


@pytest.mark.parametrize("check", PRINTED, ids=lambda check: check.name)
def test_the_printed_or_naive_form_does_not(check):
    assert formula.measure_error(check, check.printed).share > 1000


def test_the_printed_w2_gives_what_the_notes_say():
    check = registry.CHECKS["W2 of two deviations"]
    assert formula.measure_error(check, check.printed).computed == -131072


def test_every_description_has_functions_and_every_function_a_description():
    names = [about["formula"] for about in DESCRIPTIONS]
    assert sorted(names) == sorted(registry.CHECKS)


def test_names_tell_formulas_apart():
    assert sum(len(module.CHECKS) for module in registry.MODULES) == len(registry.CHECKS)


def test_every_row_of_the_notes_on_numerics_has_a_check_or_a_reason_why_not(root):
    notes = (root / "docs/research/numerics.md").read_text(encoding="utf-8").splitlines()
    items = {line.split(" | ")[0].removeprefix("| ") for line in notes if line.startswith("| ")} - {"item"}
    assert len(items) > 15
    assert items - {about["item"] for about in DESCRIPTIONS} == set(registry.WITHOUT)


def make_check(compute, relative=1e-5, absolute=1e-3):
    x = np.array([0.0, 1.0, 4.0])
    cases = [Case("x = ", (x,), x), Case("a large one", (np.array([1e6]),))]
    return Check("double", lambda: cases, compute, lambda x: 2 * x, relative, absolute)


def test_the_worst_place_is_the_one_nearest_to_its_tolerance():
    broken = formula.measure_error(make_check(compute := lambda x: 2 * x + np.where(x == 4, 0.1, 0.01)), compute)
    assert broken.label == "x = 4" and (broken.computed, broken.expected) == (8.1, 8)
    assert broken.share == pytest.approx(0.1 / (1e-3 + 8e-5)) and broken.absolute == pytest.approx(0.1)
    assert broken.relative == pytest.approx(0.1 / 8)  # errors of values near 0 do not count


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_exceeds_every_tolerance(bad):
    found = formula.measure_error(make_check(lambda x: x), lambda x: np.where(x == 1, bad, 2 * x))
    assert not found.finite and found.share == np.inf and found.label == "x = 1"


def test_equal_numbers_are_no_error_even_without_tolerance():
    exact = make_check(lambda x: 2 * x, 0.0, 0.0)
    assert formula.measure_error(exact, exact.compute).share == 0
    assert formula.measure_error(replace(exact, reference=lambda x: x), exact.compute).share == np.inf
