"""Overlays, fly paths, pictures to keep, and the numbers about the worker."""

import json

import numpy as np
import pytest
from fixtures.bundles import Ground

from dav_gswt.study.terrain.browser import served

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


@pytest.fixture(scope="module")
def uncertain(page_of):
    """A page whose tiles 0 to 7 have uncertainty 0 and whose others have 1."""
    folder = page_of(Ground())
    manifest = json.loads((folder / "davgswt.json").read_text())
    for tile in manifest["tiles"]:
        tile["uncertainty"] = float(tile["tile"] >= 8)
    (folder / "davgswt.json").write_text(json.dumps(manifest))
    with served(folder) as address:
        yield address


@pytest.mark.parametrize("overlay", ["tile", "level", "order", "uncertainty"])
def test_an_overlay_paints_the_tiles_and_goes_again(still, uncertain, overlay):
    seen = still(uncertain, 160, 100)
    plain = seen.at(**OBLIQUE)
    seen.page.select_option("#overlay", overlay)
    painted = seen.picture()
    assert seen.state["overlay"] == overlay
    assert np.abs(painted - plain).mean() > 15
    seen.page.select_option("#overlay", "picture")
    assert (seen.picture() == plain).all()


def test_uncertain_tiles_are_warm_and_sure_ones_cool(still, uncertain):
    seen = still(uncertain, 160, 100)
    seen.page.evaluate("davgswt.overlay('uncertainty')")
    found = set()
    for i in range(6):
        picture = seen.at(x=(i + 0.5) * 4, y=2.0, eye=1.0, yaw=90, pitch=-90)
        red, _, blue = picture.mean((0, 1))
        tile = seen.state["under"]["tile"]
        assert (red > blue + 30) == (tile >= 8) and (blue > red + 30) == (tile < 8)
        found.add(tile >= 8)
    assert found == {True, False}


def test_far_tiles_show_their_level_and_order(still, plain):
    seen = still(plain, 160, 100)
    seen.at(x=2.0, y=2.0, eye=6.0, yaw=0, pitch=-25)
    counts = {}
    for overlay in ("level", "order"):
        seen.page.evaluate("name => davgswt.overlay(name)", overlay)
        picture = seen.picture()
        hue = np.argmax(picture[40:], -1)
        counts[overlay] = {int(v) for v in np.unique(hue)}
    assert len(counts["level"]) + len(counts["order"]) >= 3, "more than one colour is seen"


def test_a_walk_is_recorded_played_and_saved(visit, plain):
    seen = visit(160, 100).open(plain)
    seen.at(**OBLIQUE)
    seen.page.keyboard.press("r")
    seen.page.keyboard.down("w")
    seen.until("davgswt.state.x > 3.3")
    seen.page.keyboard.up("w")
    seen.until("davgswt.flyPath.path.length > 2")
    seen.page.keyboard.press("r")
    end = seen.page.evaluate("davgswt.flyPath.path.at(-1)")
    seen.at(x=-50.0)
    seen.page.keyboard.press("p")
    seen.until("davgswt.flyPath.mode === 'rest'")
    assert seen.state["x"] == pytest.approx(end["x"]) and seen.state["yaw"] == pytest.approx(20.0)
    with seen.page.expect_download() as download:
        seen.page.locator("#save").dispatch_event("click")
    saved = json.loads(download.value.path().read_text())
    assert saved["path"][0]["x"] == pytest.approx(3.0) and saved["path"][-1] == end


def test_between_recorded_places_the_way_is_straight_and_turns_are_short(modules):
    places = modules.evaluate(
        """async () => {
          const { placeAt } = await import("./ui/fly_path.js");
          const path = [{ seconds: 0, x: 0, y: 2, eye: 1, yaw: 350, pitch: 0 },
                        { seconds: 2, x: 4, y: 0, eye: 3, yaw: 10, pitch: -8 }];
          return [-1, 1, 9].map(seconds => placeAt(path, seconds));
        }"""
    )
    assert places[1] == {"x": 2, "y": 1, "eye": 2, "yaw": 360, "pitch": -4}
    assert places[0]["x"] == 0 and places[2]["x"] == 4


def test_a_picture_is_kept_as_a_file(visit, plain):
    seen = visit(160, 100).open(f"{plain}?still")
    with seen.page.expect_download() as download:
        seen.page.keyboard.press("c")
    assert download.value.suggested_filename == "endless-terrain.png"
    assert download.value.path().read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_page_says_how_long_render_sort_and_update_take(visit, plain):
    seen = visit(480, 300).open(f"{plain}?still")
    seen.at(**OBLIQUE)
    seen.picture()
    stats = seen.page.evaluate("davgswt.stats")
    assert {"render", "sort", "update", "share"} == set(stats) and 0 < stats["share"] <= 1
    assert not seen.page.locator("#numbers").is_visible(), "nobody asked for them yet"
    seen.page.keyboard.press("i")
    text = seen.page.locator("#times").inner_text()
    assert all(word in text for word in ("render", "sort", "update", "±", "% of frames"))


def test_letters_are_commands_again_after_a_choice_by_the_pointer(still, uncertain):
    seen = still(uncertain, 160, 100)
    for opened_by, focused in (("pointerdown", "BODY"), ("keydown", "SELECT")):
        seen.page.locator("#overlay").focus()
        seen.page.locator("#overlay").dispatch_event(opened_by)
        seen.page.select_option("#overlay", "level")
        assert seen.page.evaluate("document.activeElement.tagName") == focused


def test_values_under_a_pointer_at_rest_follow_the_overlay(still, uncertain):
    seen = still(uncertain, 640, 400)
    seen.at(**OBLIQUE)
    seen.page.mouse.move(320, 200)
    seen.page.evaluate("davgswt.overlay('tile')")
    seen.until("document.getElementById('legend').textContent.includes('Here: tile')")
