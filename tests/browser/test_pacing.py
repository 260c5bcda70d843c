"""What is drawn while something moves and at rest, on every device, and what a small cache holds."""

from collections import Counter

import pytest
from fixtures.browser import served
from fixtures.bundles import Ground
from fixtures.page_visit import VIEWER

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
BUDGETS = """async ([drawn, all]) => {
  // budgets of the pictures at rest, and when each was due, where there are `all` Gaussians
  const { createRest } = await import("./draw/pacing.js");
  const rest = createRest(), seen = [], progress = [];
  rest.restart(1000, drawn);
  for (let now = 1000; now < 3000; now += 16) {
    const next = rest.next(now);
    if (!next) continue;
    seen.push([now, next]);
    progress.push(rest.progress(next, 0), rest.progress(next, 1));
    rest.finish(next, next >= all);
  }
  return [seen, progress, rest.whole];
}"""


@pytest.mark.parametrize(
    "drawn, all_, budgets",
    [
        pytest.param(20_000, 9e9, [250_000, 1_000_000, 6_000_000], id="slow device"),
        pytest.param(200_000, 9e9, [1_000_000, 6_000_000], id="no step that is hardly seen"),
        pytest.param(20_000, 900_000, [250_000, 1_000_000], id="all are drawn"),
        pytest.param(6_000_000, 9e9, [6_000_000], id="fast device"),
    ],
)
def test_budgets_grow_until_all_is_drawn_whatever_the_device(modules, drawn, all_, budgets):
    seen, progress, whole = modules.evaluate(BUDGETS, [drawn, all_])
    assert [budget for _, budget in seen] == budgets and whole
    assert seen[0][0] - 1000 >= 300
    assert progress == sorted(progress) and progress[0] >= 0 and progress[-1] <= 1


@pytest.mark.slow
def test_a_picture_at_rest_is_the_one_that_is_drawn_at_once_after_progress_and_a_walk(visit, page_of, slow_device):
    with served(page_of(Ground(discs=24))) as address:
        seen = visit(320, 200)
        seen.page.add_init_script(slow_device.replace("150", "60"))
        seen.open(address)
        seen.until("!refining.hidden && refining.value > 0")
        assert not seen.state["whole"]
        seen.until("davgswt.state.whole", seconds=90)
        assert not seen.page.locator("#refining").is_visible()
        seen.page.keyboard.down("w")
        seen.until("davgswt.state.x > 2.3 && !davgswt.state.whole")
        seen.page.keyboard.up("w")
        seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
        grabbed = seen.page.evaluate("davgswt.grab()")
        assert (seen.decode(*grabbed) == seen.at(**OBLIQUE)).all()


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


@pytest.mark.parametrize("refresh", [1000 / 60, 1000 / 120])
def test_a_machine_in_between_comes_to_rest_below_what_it_can_do_on_its_display(modules, refresh):
    a_splat = 20 / 500_000 * refresh / (1000 / 60)
    settled = pace(modules, 900, a_splat, 0.0, refresh)[0][600:]
    assert min(settled) > 300_000 and max(settled) < 1.21 * min(settled)
    assert 1.0 * refresh < a_splat * settled[-1] <= 1.44 * refresh


GROUND = Ground(discs=64, levels=3, speckle=20)  # 16 tiles of 4096, 1024 and 256 Gaussians: 2.8 MB in memory
GAUSSIANS = 16 * (4096 + 1024 + 256)
CACHE = 960e3  # bytes: a third
PHONE = dict(width=390, height=720, is_mobile=True, has_touch=True, screen={"width": 390, "height": 844})


@pytest.fixture(scope="module")
def large(page_of):
    with served(page_of(GROUND)) as address:
        yield address


def set_cache(tab, cache: float) -> None:
    """Give the viewer's modules in a tab a cache of another size."""
    text = (VIEWER / "data/layout.js").read_text()
    assert text.count("CACHE_BYTES = 192e6") == 1
    text = text.replace("CACHE_BYTES = 192e6", f"CACHE_BYTES = {cache:.0f}")
    tab.route("**/layout.js", lambda route: route.fulfill(body=text, content_type="text/javascript"))


def watch(seen, cache: float = CACHE) -> Counter:
    """Give the page a cache of another size; returns requests by part, counted as they are made."""
    set_cache(seen.page, cache)
    asked = Counter()
    count = lambda request: asked.update([request.url]) if "/parts/" in request.url else None  # noqa: E731
    seen.page.on("request", count)
    return asked


def test_at_rest_nothing_is_composed_twice_and_the_nearest_ground_is_fine(visit, large):
    seen = visit(320, 200)
    asked = watch(seen)
    seen.open(large)
    seen.until("davgswt.state.whole")
    seen.page.wait_for_timeout(500)  # the next finer levels of uncertain tiles are composed as far as there is room
    before = seen.state["work"]
    seen.page.wait_for_timeout(1500)  # a loop would go on
    work = seen.state["work"]
    assert work["composed"] == before["composed"] < GAUSSIANS
    assert max(asked.values()) == 1
    assert work["bytes"] <= CACHE
    levels = [cell["level"] for cell in seen.state["drawn"]]
    assert levels[-1] == 0 and max(levels) == 2  # back to front
    # a picture to keep comes to its end
    assert seen.page.evaluate("davgswt.grab().then(([width]) => width)") == 320


@pytest.mark.slow
def test_a_phone_asks_before_it_loads_a_large_set(visit, large):
    """The threshold of 50 MB is replaced by one of 10 kB."""
    seen = visit(**PHONE)
    asked = watch(seen, 192e6)
    text = (VIEWER / "ui/hud.js").read_text()
    assert text.count("50e6") == 1
    seen.page.route(
        "**/hud.js", lambda route: route.fulfill(body=text.replace("50e6", "1e4"), content_type="text/javascript")
    )
    seen.open(large, wait=False)
    seen.until("!agree.hidden")
    assert not asked and "Load up to " in seen.page.locator("#agree").inner_text()
    seen.page.locator("#agree").click()
    seen.page.evaluate("davgswt.ready.then(() => 0)")
    assert set(asked.values()) == {1}
