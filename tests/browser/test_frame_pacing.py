"""What is drawn while something moves: less where frames come slowly, more where they come fast, and no to and fro."""

import pytest

PACE = """async ([frames, refresh, a_splat, a_pixel]) => {
  // budget and scale after each frame; a_splat: milliseconds of one; a_pixel: of all at full resolution
  const { createFramePacing } = await import("./draw/pacing.js");
  const pacing = createFramePacing(refresh), seen = [];
  for (let k = 0; k < frames; k++) {
    const took = Math.max(refresh, a_splat * pacing.budget, a_pixel * pacing.scale ** 2);
    pacing.addFrame(took, pacing.budget);
    seen.push([pacing.budget, pacing.scale]);
  }
  return seen;
}"""


def pace(modules, frames, a_splat=0.0, a_pixel=0.0, refresh=1000 / 60) -> tuple[list, list]:
    """Budgets and scales."""
    seen = modules.evaluate(PACE, [frames, refresh, a_splat, a_pixel])
    return [budget for budget, _ in seen], [scale for _, scale in seen]


def test_a_fast_machine_has_all_within_two_seconds_and_few_frames_say_nothing(modules):
    budgets, scales = pace(modules, 120)
    assert budgets[-1] == 6_000_000 and scales[-1] == 1 and set(budgets[:2]) == {100_000}


def test_a_slow_machine_gets_the_least_and_no_less(modules):
    budgets, _ = pace(modules, 30, 0.01)
    assert min(budgets) == budgets[-1] == 20_000


@pytest.mark.parametrize("refresh", [1000 / 60, 1000 / 120])
def test_a_machine_in_between_comes_to_rest_below_what_it_can_do_on_its_display(modules, refresh):
    a_splat = 20 / 500_000 * refresh / (1000 / 60)
    settled = pace(modules, 900, a_splat, 0.0, refresh)[0][600:]
    assert min(settled) > 300_000 and max(settled) < 1.21 * min(settled)
    assert 1.0 * refresh < a_splat * settled[-1] <= 1.44 * refresh


def test_where_pixels_are_slow_the_resolution_is_lower_and_the_budget_stays(modules):
    budgets, scales = pace(modules, 600, 0.0, 100.0)
    # 24 ms allow 0.49 of the resolution along each side, 19 ms 0.44
    assert min(scales[200:]) > 0.4 and max(scales[200:]) < 0.5 and len(set(scales[200:])) < 4
    assert set(budgets[200:]) == {100_000}


@pytest.mark.parametrize("took, scale", [(5, 1), (21, 0.5), (84, 0.3), (10, 0.7246)])
def test_the_first_picture_says_which_resolution_to_begin_with(modules, took, scale):
    begin = """async took => {
      const { createFramePacing } = await import("./draw/pacing.js"), pacing = createFramePacing();
      pacing.begin(took);
      return pacing.scale;
    }"""
    assert modules.evaluate(begin, took) == pytest.approx(scale, abs=1e-3)
