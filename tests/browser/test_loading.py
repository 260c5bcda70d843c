"""Loading: in the manifest's order, nothing from outside, and one readable message where something is wrong."""

import pytest
from fixtures.browser import served
from fixtures.bundles import Ground
from playwright.sync_api import Error


def test_no_request_leaves_the_page_and_nothing_is_complained_about(visit, plain):
    seen = visit(160, 100)
    asked, complaints = [], []
    seen.page.on("request", lambda request: asked.append(request.url))
    seen.page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    seen.page.on("pageerror", lambda error: complaints.append(str(error)))
    seen.open(plain)
    assert complaints == []
    assert {url.startswith((plain, "data:")) for url in asked} == {True}
    parts = [url for url in asked if "/parts/" in url]
    assert len(asked) > 32 and 0 < len(parts) == len(set(parts))


def test_a_part_that_the_server_misses_once_is_no_failure(visit, plain):
    seen, asked = visit(160, 100), []

    def answer(route):
        asked.append(route.request.url)
        if len(asked) == 1:
            route.fulfill(status=503)
        else:
            route.continue_()

    seen.page.route("**/parts/*", answer)
    seen.open(plain)
    assert seen.state["error"] is None and asked.count(asked[0]) == 2


@pytest.mark.slow
@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda f: min((f / "parts").iterdir()).unlink(), ".bin is not there"),
        (lambda f: (f / "davgswt.json").unlink(), "davgswt.json is not there (the server answered 404)"),
    ],
    ids=["no part", "no manifest"],
)
def test_a_spoilt_bundle_is_named_with_what_to_do(visit, page_of, spoil, message):
    folder = page_of(Ground(discs=4))
    with served(folder) as address:
        spoil(folder)
        assert_said(visit(480, 300), address, message)


@pytest.mark.slow
def test_a_browser_without_webgl2_is_told(visit, plain):
    seen = visit(480, 300)
    seen.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    assert_said(seen, plain, "no WebGL2")


def assert_said(seen, address, message):
    """The page shows one message as an alert, nothing is left spinning, and `ready` is rejected."""
    seen.open(address, wait=False)
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert message in alert.inner_text()
    assert not seen.page.locator("#loading").is_visible()
    assert seen.page.evaluate("davgswt.ready.then(() => 'ready', () => 'refused')") == "refused"


PHOTOS = [{"round": int(k > 2), "at": [k - 2.0, 1.0, 3.0], "look": [0.5, -0.5], "picture": k} for k in range(5)]
ROUNDS = [{"photos": 3, "psnr": 27.1}, {"photos": 2, "psnr": None}]
VALUE = dict(unit="metre", half=2.0, photos=PHOTOS, rounds=ROUNDS, thumb=120, columns=8, pictures=5)


@pytest.mark.parametrize(
    "change, sound",
    [
        ({"more": 1}, True),
        ({"unit": 3}, False),
        ({"half": 0}, False),
        ({"thumb": 0}, False),
        ({"columns": 65}, False),
        ({"photos": 3}, False),
        ({"photos": [{"round": 0, "at": ["1", 2, 3], "look": [0, 0]}]}, False),
        ({"photos": [{"round": 0, "at": [1, 2, 3], "look": [0]}]}, False),
        ({"photos": [PHOTOS[0] | {"picture": 5}]}, False),
        ({"rounds": [{"photos": -1, "psnr": 1}]}, False),
        ({"rounds": [{"photos": 1, "psnr": "1"}]}, False),
    ],
)
def test_a_story_is_read_or_refused(call, change, sound):
    if sound:
        assert call("ui/story.js", "readStory", VALUE | change) == VALUE
    else:
        with pytest.raises(Error, match="story.json is not as the workflow writes it"):
            call("ui/story.js", "readStory", VALUE | change)
