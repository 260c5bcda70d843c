"""Side by side: the terrain on the left of a divider, an overlay on its right, of one view."""

import numpy as np
import pytest

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


def halves(seen, overlay):
    """The pictures without and with an overlay."""
    seen.page.evaluate("davgswt.overlay('picture')")
    plain = seen.at(**OBLIQUE)
    seen.page.select_option("#overlay", overlay)
    return plain, seen.picture()


@pytest.fixture
def seen(visit, plain):
    return visit(480, 320).open(f"{plain}?still")


@pytest.mark.parametrize("overlay", ["level", "order", "material"])
def test_the_left_is_the_terrain_and_the_right_the_overlay(seen, overlay):
    plain, painted = halves(seen, overlay)
    seen.page.locator("#compare").click()
    both = seen.picture()
    assert (both[:, :240] == plain[:, :240]).all() and (both[:, 240:] == painted[:, 240:]).all()
    assert np.abs(plain - painted).mean() > 10
    assert seen.page.locator("#divider").inner_text().split("\n")[0] == "Terrain"
    seen.page.locator("#compare").click()
    assert (seen.picture() == painted).all() and not seen.page.locator("#divider").is_visible()


def test_the_divider_is_dragged_and_moved_by_keys_and_nobody_turns(seen):
    plain, painted = halves(seen, "level")
    seen.page.keyboard.press("b")
    seen.page.mouse.move(240, 100)
    seen.page.mouse.down()
    seen.page.mouse.move(120, 110, steps=3)
    seen.page.mouse.up()
    both = seen.picture()
    assert (both[:, :120] == plain[:, :120]).all() and (both[:, 120:] == painted[:, 120:]).all()
    divider = seen.page.get_by_role("slider", name="Divider")
    assert divider.get_attribute("aria-valuenow") == "25" and divider.bounding_box()["width"] == 44
    divider.focus()
    for key, now in [("ArrowRight", "30"), ("ArrowLeft", "25"), ("End", "98"), ("Home", "2"), ("ArrowLeft", "2")]:
        seen.page.keyboard.press(key)
        assert divider.get_attribute("aria-valuenow") == now
    assert {k: seen.state[k] for k in OBLIQUE} == OBLIQUE


def test_without_an_overlay_there_is_nothing_to_compare(seen):
    assert not seen.page.locator("#compare").is_visible()
    seen.page.keyboard.press("b")
    seen.until("!divider.hidden")
    assert seen.state["overlay"] == "level"
    seen.page.select_option("#overlay", "picture")
    seen.until("divider.hidden && compare.hidden")
    plain = seen.picture()
    assert (plain == seen.at(**{})).all()


def test_at_rest_both_sides_are_drawn_to_the_end(visit, plain):
    seen = visit(480, 320).open(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.keyboard.press("b")
    seen.until("davgswt.state.whole")
    grabbed = seen.decode(*seen.page.evaluate("davgswt.grab()"))
    assert (grabbed == seen.picture()).all()
