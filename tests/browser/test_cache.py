"""A set that is larger than the page's chunk cache: nothing is downloaded twice, and at rest nothing composed twice."""

from collections import Counter

import pytest
from fixtures.browser import served
from fixtures.bundles import Ground
from fixtures.page_visit import VIEWER

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
