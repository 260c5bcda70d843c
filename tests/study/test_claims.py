"""The page of the paper's claims: what a difference says, and that the page's figures are those of the tables."""

import pytest

from dav_gswt.study.claims import PAGE, Difference, write_claims


def test_the_page_has_the_figures_of_the_tables(root):
    assert (root / PAGE).read_text() == write_claims(root), "run `make reference`"


@pytest.mark.parametrize(
    ("low", "high", "word"),
    [(0.1, 0.3, "holds"), (-0.1, 0.3, "not shown"), (0.0, 0.3, "not shown"), (-0.3, -0.1, "contradicted")],
)
def test_an_interval_decides_whether_a_claim_holds(low, high, word):
    assert Difference(0.1, low, high).judge() == word


def test_the_second_less_the_first_turns_the_interval_round():
    assert Difference(0.2, -0.1, 0.5).reverse() == Difference(-0.2, -0.5, 0.1)


def test_a_difference_without_an_interval_is_judged_by_the_means_and_says_so():
    assert Difference(-0.2).judge() == "by the means, no"


@pytest.mark.parametrize(("low", "high", "word"), [(0.1, 0.3, "both"), (-0.1, 0.3, "one"), (-0.3, -0.1, "neither")])
def test_of_two_scenes_it_is_said_in_how_many_a_claim_holds(low, high, word):
    assert Difference(0.1, low, high, pairs=2).judge() == f"in {word} of 2 scenes"


@pytest.mark.parametrize(("p", "word"), [(0.35, "not shown"), (0.01, "holds")])
def test_a_test_that_shows_nothing_outweighs_the_interval(p, word):
    assert Difference(0.4, 0.1, 0.9, pairs=6, p=p).judge() == word


@pytest.mark.parametrize(("unit", "text"), [("dB", "+0.20 (-0.10, +0.50) dB"), ("", "+0.2000 (-0.1000, +0.5000)")])
def test_differences_of_lpips_have_four_digits(unit, text):
    assert Difference(0.2, -0.1, 0.5).format(unit) == text
