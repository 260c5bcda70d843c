"""The splat budget: fewer splats where frames come slowly, more where they come fast, and no to and fro."""

PACE = """async ([frames, cost]) => {
  // `cost(budget)`: milliseconds a frame with that many splats, at least one refresh of 60 Hz
  const { createPace } = await import("./pace.js");
  const pace = createPace(), budgets = [];
  for (let k = 0; k < frames; k++) {
    pace.frame(Math.max(1000 / 60, cost * pace.budget), pace.budget);
    budgets.push(pace.budget);
  }
  return budgets;
}"""


def budgets(visit, plain, frames, cost):
    return visit(160, 100).open(f"{plain}?still").page.evaluate(PACE, [frames, cost])


def test_a_fast_machine_gets_all_there_is(visit, plain):
    assert budgets(visit, plain, 600, 0)[-1] == 6_000_000


def test_a_slow_machine_gets_the_least_and_no_less(visit, plain):
    assert min(budgets(visit, plain, 30, 0.01)) == budgets(visit, plain, 30, 0.01)[-1] == 20_000


def test_a_machine_in_between_comes_to_rest_below_what_it_can_do(visit, plain):
    # 20 ms at 500,000 splats: after 600 frames the budget is one that frames of 24 ms allow, and stays
    settled = budgets(visit, plain, 900, 20 / 500_000)[600:]
    assert min(settled) > 300_000 and max(settled) < 1.21 * min(settled) and max(settled) <= 600_000


def test_few_frames_say_nothing(visit, plain):
    assert set(budgets(visit, plain, 2, 1)) == {100_000}
