"""What is drawn while something moves: less where frames come slowly, more where they come fast, and no to and fro."""

import json

import pytest
from fixtures.page_visit import Visit

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


def test_a_fast_machine_has_all_within_two_seconds(modules):
    seen = modules.evaluate(
        """async () => {
          const { createFramePacing } = await import("./draw/frame_pacing.js");
          const pacing = createFramePacing();
          let time = 0;
          for (; time < 10_000 && (pacing.budget < 6_000_000 || pacing.scale < 1); time += 1000 / 60) {
            pacing.addFrame(1000 / 60, pacing.budget);
          }
          return time;
        }"""
    )
    assert seen < 2000


@pytest.mark.parametrize("refresh", [1000 / 72, 1000 / 120])
def test_the_pace_is_held_to_the_display_that_there_is(modules, refresh):
    # 0.02 microseconds a splat: at 120 Hz 12.0 ms, the slowest that is held, allow 600,000 splats
    settled = modules.evaluate(
        """async ([refresh]) => {
          const { createFramePacing } = await import("./draw/frame_pacing.js");
          const pacing = createFramePacing(refresh);
          for (let k = 0; k < 2000; k++) pacing.addFrame(Math.max(refresh, 2e-5 * pacing.budget), pacing.budget);
          return pacing.budget;
        }""",
        [refresh],
    )
    assert 1.0 * refresh < 2e-5 * settled <= 1.44 * refresh


KEPT = """async ([text, device]) => {
  const { describePace, readPace } = await import("./ui/kept_pace.js");
  return [readPace(text, device), readPace(describePace({ budget: 345678.4, scale: 0.61803 }, device), device)];
}"""


@pytest.mark.parametrize(
    "text, found",
    [
        pytest.param(None, None, id="none"),
        pytest.param("", None, id="empty"),
        pytest.param("{", None, id="no JSON"),
        pytest.param("null", None, id="null"),
        pytest.param('{"version":2,"device":"one","budget":5e5,"scale":1}', None, id="other version"),
        pytest.param('{"version":1,"device":"two","budget":5e5,"scale":1}', None, id="other device"),
        pytest.param('{"version":1,"device":"one","budget":"5e5","scale":1}', None, id="text"),
        pytest.param('{"version":1,"device":"one","budget":1e999,"scale":1}', None, id="infinite"),
        pytest.param(f'{{"version":1,"device":"one","budget":5e5,"scale":1{" " * 2000}}}', None, id="long"),
        pytest.param('{"version":1,"device":"one","budget":9e9,"scale":7}', [6_000_000, 1], id="too much"),
        pytest.param('{"version":1,"device":"one","budget":-1,"scale":0}', [20_000, 0.3], id="too little"),
    ],
)
def test_a_kept_pace_is_bounded_and_ignored_when_it_is_broken(modules, text, found):
    read, again = modules.evaluate(KEPT, [text, "one"])
    assert read == (found and {"budget": found[0], "scale": found[1]})
    assert again == {"budget": 345678, "scale": 0.618}


def test_the_next_visit_begins_with_the_pace_of_the_last(chromium, plain):
    with chromium.new_context(viewport={"width": 160, "height": 100}) as context:
        first = Visit(context.new_page()).open(plain)
        assert first.page.evaluate("localStorage.getItem('davgswt.pace')") is None, "nothing was measured yet"
        first.page.keyboard.down("w")
        first.until("localStorage.getItem('davgswt.pace')")
        first.page.keyboard.up("w")
        kept = json.loads(first.page.evaluate("localStorage.getItem('davgswt.pace')"))
        kept |= {"budget": 234_567, "scale": 0.5}
        first.page.close()
        second = context.new_page()
        # once: the page before may have written when it was left
        second.add_init_script(f"localStorage.setItem('davgswt.pace', {json.dumps(json.dumps(kept))})")
        seen = Visit(second).open(plain)
        assert seen.state["budget"] == 234_567


def test_a_browser_without_storage_has_the_page_all_the_same(visit, plain):
    seen = visit(160, 100)
    seen.page.add_init_script(
        "Object.defineProperty(window, 'localStorage', { get() { throw new DOMException('no') } })"
    )
    seen.open(plain)
    assert seen.state["budget"] == 100_000 and seen.state["error"] is None
