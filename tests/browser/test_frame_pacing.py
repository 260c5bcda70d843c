"""The splat budget: fewer splats where frames come slowly, more where they come fast, and no to and fro."""

REST = """async ([cost, all]) => {
  // budgets of the pictures at rest, where a Gaussian costs so many milliseconds and there are `all` of them
  const { createIdleRefine } = await import("./draw/idle_refine.js");
  let now = 0, done = 0;
  const gl = { fenceSync: () => 1, deleteSync: () => {}, SIGNALED: 1, getSyncParameter: () => Number(now >= done) };
  const idle = createIdleRefine(gl), budgets = [];
  let used = 20000;
  const draw = () => (idle.addPicture(now), (done = now + cost * used));
  idle.restart(now, used);
  draw();
  for (; now < 20000; now += 16) {
    const more = idle.nextBudget(now, used === all);
    if (!more) continue;
    budgets.push([now, more]);
    used = Math.min(more, all);
    draw();
  }
  return budgets;
}"""
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


def pictures_at_rest(modules, cost, all_):
    return modules.evaluate(REST, [cost, all_])


def test_at_rest_the_picture_gets_all_there_is_after_a_while(modules):
    found = pictures_at_rest(modules, 1e-5, 1_000_000)
    assert [budget for _, budget in found] == [80_000, 320_000, 1_280_000]
    assert found[0][0] >= 500


def test_at_rest_a_slow_machine_is_not_kept_busy_for_long(modules):
    # 400 ms for 20,000: four times as many would take longer than somebody who walks on may wait
    assert pictures_at_rest(modules, 400 / 20_000, 1_000_000) == []
    assert [budget for _, budget in pictures_at_rest(modules, 100 / 20_000, 1_000_000)] == [80_000]
