"""The panel that says how a terrain was made."""

import numpy as np
import pytest
from fixtures import bundles
from fixtures.page_visit import VIEWER
from playwright.sync_api import Error

from dav_gswt.images.jpeg import encode_jpeg
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.page_front import Front
from dav_gswt.terrain.page_story import Story

PHOTOS = [{"round": int(k > 2), "at": [k - 2.0, 1.0, 3.0], "look": [0.5, -0.5], "picture": k} for k in range(5)]
ROUNDS = [{"photos": 3, "psnr": 27.1, "preset": "draft"}, {"photos": 2, "psnr": None}]
VALUE = dict(unit="metre", half=2.0, photos=PHOTOS, rounds=ROUNDS, thumb=120, columns=8, pictures=5)


@pytest.mark.slow
def test_the_panel_shows_places_rounds_and_photos(visit, plain, tmp_path):
    bundles.write_bundle(tmp_path / "bundle", bundles.Ground())
    picture = encode_jpeg(np.full((120, 960, 3), 0.5), 60)
    front = Front("Meadow", "From 5 photos", picture, Story(VALUE, picture))
    write_page(tmp_path / "bundle", VIEWER, tmp_path / "page", front=front)
    with served(tmp_path / "page") as address:
        seen = visit(360, 640).open(f"{address}?still")
        seen.page.locator("#menuButton").click()
        seen.page.locator("#storyButton").click()
        panel = seen.page.locator("#story")
        panel.locator("svg").wait_for()
        assert panel.locator("circle").count() == 5 and panel.locator(".photos div").count() == 5
        assert [text.strip() for text in panel.locator("tbody tr").all_inner_texts()] == [
            "start\t3\t27.1 dB (draft)",
            "round 1\t+ 2\tnone",
        ]
        assert panel.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
        seen.page.keyboard.press("Escape")
        assert not panel.is_visible() and not seen.page.locator("#menu").is_visible()
        (tmp_path / "page/story.json").write_text("{}")
        seen.open(f"{address}?still")
        seen.page.locator("#menuButton").click()
        seen.page.locator("#storyButton").click()
        alert = seen.page.get_by_role("alert")
        alert.wait_for(state="visible")
        assert "story.json is not as the workflow writes it" in alert.inner_text()
        seen.open(f"{plain}?still")
        seen.page.locator("#menuButton").click()
        assert not seen.page.locator("#storyButton").is_visible(), "this page has none"


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
        ({"rounds": [{"photos": 1, "psnr": 1, "preset": 3}]}, False),
    ],
)
def test_a_story_is_read_or_refused(call, change, sound):
    if sound:
        assert call("data/story.js", "readStory", VALUE | change) == VALUE
    else:
        with pytest.raises(Error, match="story.json is not as the workflow writes it"):
            call("data/story.js", "readStory", VALUE | change)
