"""Every formula holds its tolerance over its whole range, and what says so can tell when one does not."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.study.stability import formula, registry
from dav_gswt.study.stability.formula import Formula, Point, Tolerance

GROUPS = list(registry.GROUPS.items())
ALL = [found for _, members in GROUPS for found in members]
PRINTED = [found for found in ALL if found.printed]


@pytest.mark.parametrize("members", [pytest.param(members, id=group) for group, members in GROUPS])
def test_the_formulas_of_a_group_hold_their_tolerances(members):
    rows = [formula.row(found) for found in members]
    assert {row["formula"]: row["worst_at"] for row in rows if not row["finite"] or row["share_of_tolerance"] > 1} == {}


@pytest.mark.parametrize("found", PRINTED, ids=lambda found: found.name)
def test_the_printed_or_naive_form_does_not(found):
    assert formula.error(found, found.printed).share > 1000


def test_the_printed_w2_gives_what_the_notes_say():
    (found,) = (f for f in ALL if f.name == "W2 of two deviations")
    assert formula.error(found, found.printed).found == -131072


def test_every_row_of_the_notes_on_numerics_has_a_formula_or_a_reason(root):
    notes = (root / "docs/research/numerics.md").read_text(encoding="utf-8").splitlines()
    items = {line.split(" | ")[0].removeprefix("| ") for line in notes if line.startswith("| ")} - {"item"}
    assert len(items) > 15
    assert items - {found.item for found in ALL} == set(registry.WITHOUT)


def test_names_tell_formulas_apart():
    assert len({found.name for found in ALL}) == len(ALL)


MADE_UP = Tolerance(1e-5, 1e-3, "made up")


def doubled(found, tolerance=MADE_UP):
    x = np.array([0.0, 1.0, 4.0])
    points = [Point("x = ", (x,), x), Point("a large one", (np.array([1e6]),))]
    return Formula("", "", "", "", "float32", lambda: points, found, lambda x: 2 * x, tolerance)


def test_the_worst_place_is_the_one_nearest_to_its_tolerance():
    broken = formula.error(doubled(found := lambda x: 2 * x + np.where(x == 4, 0.1, 0.01)), found)
    assert broken.at == "x = 4" and (broken.found, broken.wanted) == (8.1, 8)
    assert broken.share == pytest.approx(0.1 / (1e-3 + 8e-5)) and broken.absolute == pytest.approx(0.1)
    assert broken.relative == pytest.approx(0.1 / 8)  # the error at 0 is none of a value


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_exceeds_every_tolerance(bad):
    found = formula.error(doubled(lambda x: x), lambda x: np.where(x == 1, bad, 2 * x))
    assert not found.finite and found.share == np.inf and found.at == "x = 1"


def test_equal_numbers_are_no_error_even_without_tolerance():
    exact = doubled(lambda x: 2 * x, Tolerance(0.0, 0.0, "exact"))
    assert formula.error(exact, exact.ours).share == 0
    assert formula.error(replace(exact, reference=lambda x: x), exact.ours).share == np.inf
