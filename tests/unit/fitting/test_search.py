"""A fit that finds its own number of steps ends by its bound, whatever the held-out pixels say."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.fitting.plan import Plan, Report
from dav_gswt.fitting.search import Search


def run(plan, views, gains):
    """Steps until the fit ends, where each look gains what `gains` says next, over and over."""
    search, report, psnr, degree, step = Search.of(plan, views, 100), Report(), 20.0, 0, 0
    while not search.done(step):
        step += 1
        if step % search.window == 0:
            psnr += gains[(step // search.window) % len(gains)]
            told = search.look(step, psnr, 100, degree, report)
            degree += {"enrich": 1, "take back": -1}.get(told, 0)
    return step, report, search


@given(
    st.integers(1, 40),
    st.integers(1000, 5000),
    st.lists(st.sampled_from([0.0, 0.01, 0.5, 5.0]), min_size=1, max_size=9),
)
def test_no_fit_exceeds_its_bound_and_every_trial_is_judged(views, most, gains):
    step, report, search = run(Plan("auto", "auto", "auto", most_steps=most), views, gains)
    assert step <= most and search.trying is None
    assert [choice["what"] for choice in report.choices].count("steps") == 1


def test_what_always_pays_is_ended_by_the_bound_and_said():
    step, report, _ = run(Plan("auto", 100, most_steps=1000), 10, [1.0])
    assert step == 750 and "most steps there are (1000)" in report.choices[-1]["why"]
    later, _, _ = run(Plan("auto", 100), 10, [1.0])
    assert later > 4 * step


@pytest.mark.parametrize("most", [1, 50])
def test_a_bound_below_the_first_look_holds_too(most):
    assert run(Plan("auto", "auto", "auto", most_steps=most), 10, [1.0])[0] == most
