"""What is drawn while something moves: less where frames come slowly, more where they come fast, and no to and fro."""

import pytest

PACE = """async ([frames, cost]) => {
  // `cost(budget)`: milliseconds a frame with that many splats, at least one refresh of 60 Hz
  const { createFramePacing } = await import("./draw/frame_pacing.js");
  const pacing = createFramePacing(), budgets = [];
  for (let k = 0; k < frames; k++) {
    pacing.addFrame(Math.max(1000 / 60, cost * pacing.budget), pacing.budget);
    budgets.push(pacing.budget);
  }
  return budgets;
}"""


def budgets(modules, frames, cost):
    return modules.evaluate(PACE, [frames, cost])


def test_a_fast_machine_gets_all_there_is(modules):
    assert budgets(modules, 600, 0)[-1] == 6_000_000


def test_a_slow_machine_gets_the_least_and_no_less(modules):
    assert min(budgets(modules, 30, 0.01)) == budgets(modules, 30, 0.01)[-1] == 20_000


def test_a_machine_in_between_comes_to_rest_below_what_it_can_do(modules):
    # 20 ms at 500,000 splats: after 600 frames the budget is one that frames of 24 ms allow, and stays
    settled = budgets(modules, 900, 20 / 500_000)[600:]
    assert min(settled) > 300_000 and max(settled) < 1.21 * min(settled) and max(settled) <= 600_000


def test_few_frames_say_nothing(modules):
    assert set(budgets(modules, 2, 1)) == {100_000}


SCALE = """async ([frames, cost]) => {
  // `cost`: milliseconds a frame of the full resolution takes, in proportion to its pixels
  const { createFramePacing } = await import("./draw/frame_pacing.js");
  const pacing = createFramePacing(), seen = [];
  for (let k = 0; k < frames; k++) {
    pacing.addFrame(Math.max(1000 / 60, cost * pacing.scale ** 2), pacing.budget);
    seen.push([pacing.scale, pacing.budget]);
  }
  return seen;
}"""


def test_where_pixels_are_slow_the_resolution_is_lower_and_the_budget_stays(modules):
    seen = modules.evaluate(SCALE, [600, 100])[200:]
    scales = [scale for scale, _ in seen]
    # 24 ms allow 0.49 of the resolution along each side, 19 ms 0.44
    assert min(scales) > 0.4 and max(scales) < 0.5 and len(set(scales)) < 4
    assert {budget for _, budget in seen} == {100_000}


def test_a_fast_machine_has_the_full_resolution_soon(modules):
    assert modules.evaluate(SCALE, [150, 1])[-1][0] == 1


@pytest.mark.parametrize("took, scale", [(5, 1), (21, 0.5), (84, 0.3), (1000, 0.3), (10, 0.7246)])
def test_the_first_picture_says_which_resolution_to_begin_with(modules, took, scale):
    begin = """async took => {
      const { createFramePacing } = await import("./draw/frame_pacing.js");
      const pacing = createFramePacing();
      pacing.begin(took);
      return pacing.scale;
    }"""
    assert modules.evaluate(begin, took) == pytest.approx(scale, abs=1e-3)
