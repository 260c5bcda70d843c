"""What a newcomer meets on phones and desktops: nothing lies over anything else, objects have pictures and switches."""

import numpy as np
import pytest
from fixtures.land_covers import LEAF, SIDE

from dav_gswt.files import read_json

SIZES = [(390, 844, True), (844, 390, True), (360, 640, True), (1280, 800, False), (1920, 1080, False)]
BOXES = """Object.fromEntries(
  ["title", "loading", "hint", "legend", "toast", "tools", "pad", "menu", "story", "paint", "map", "numbers"]
    .map(id => document.getElementById(id))
    .filter(one => one.checkVisibility({ visibilityProperty: true }) && one.getBoundingClientRect().width)
    .map(one => [one.id, one.getBoundingClientRect()])
    .map(([id, { left, top, right, bottom }]) => [id, [left, top, right, bottom]]))"""
PANELS = {"menu", "paint"}
SKY = "#1,1,2,0,80"  # little to draw
HIDE = "map", "numbers"  # open panels may lie over these two, what is said may not


def overlaps(boxes: dict, panels_hide: bool = True) -> list[tuple[str, str]]:
    """Pairs of names whose boxes (left, top, right, bottom) have a common area."""
    names, found = list(boxes), []
    for k, one in enumerate(names):
        for other in names[k + 1 :]:
            if panels_hide and len({one, other} & PANELS) == len({one, other} & set(HIDE)) == 1:
                continue
            a, b = np.array(boxes[one]), np.array(boxes[other])
            if (np.minimum(a, b)[2:] - np.maximum(a, b)[:2] > 0.5).all():
                found.append((one, other))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("width, height, touch", SIZES)
def test_nothing_lies_over_anything_else(visit, address, width, height, touch):
    seen = visit(width, height, has_touch=touch, is_mobile=touch).open(address + SKY)
    seen.until("!hint.hidden")
    seen.page.evaluate("document.getElementById('name').textContent = 'A meadow with a long name'")
    found, shown = {}, {}

    def check(state: str, *wanted: str) -> None:
        boxes = seen.page.evaluate(BOXES)
        found[state], shown[state] = overlaps(boxes), set(wanted) - set(boxes)
        corners = np.array(list(boxes.values()))
        assert corners.min() >= 0 and (corners[:, 2:] <= [width, height]).all(), state

    def click(name: str) -> None:
        one = seen.page.locator(f"#{name}")
        one.tap() if touch else one.click()

    pad = ["pad"] if touch else []
    check("first view", "title", "hint", "tools", *pad)
    seen.page.select_option("#overlay", "level")
    seen.until("!legend.hidden")
    click("menuButton")
    click("modes input[value=fly]")
    check("menu", "menu", "toast", "tools", *pad)
    click("mapButton")
    assert len(seen.page.locator("#toast").inner_text()) > 80, "the longest that is said"
    check("map in the menu", "menu", "toast", "map", "tools", *pad)
    click("menuClose")
    check("map", "toast", "map", "hint", "legend", "tools", *pad)
    click("menuButton")
    click("paintButton")
    check("materials", "paint", "toast", "map", "tools", *pad)
    assert {state: pairs for state, pairs in found.items() if pairs} == {}
    assert {state: names for state, names in shown.items() if names} == {}


@pytest.mark.slow
def test_an_object_has_a_picture_and_a_switch_that_files_and_links_keep(visit, address):
    seen = visit(400, 400).open(f"{address}?still{SKY}")
    page = seen.page
    density, link = "davgswt.painting.densities[0]", "davgswt.paint.keep.findLink()"
    page.keyboard.press("m")
    seen.until("document.querySelector('#densities canvas').getContext('2d').getImageData(36, 36, 1, 1).data[3] > 0")
    read = "(x, y) => [...document.querySelector('#densities canvas').getContext('2d').getImageData(x, y, 1, 1).data]"
    (red, green, blue, alpha), corner = page.evaluate(f"[({read})(36, 36), ({read})(0, 0)]")
    assert np.abs(np.array([red, green, blue]) / 255 - LEAF).max() < 0.03 and alpha > 200 > 20 > corner[3]
    switch, slider = page.get_by_role("checkbox", name="Shrub on grass"), page.get_by_role("slider", name="of Shrub")
    page.evaluate("davgswt.painting.setDensity(0, 2, true)")
    switch.uncheck()
    assert page.evaluate(density) == 0 and slider.input_value() == "0"
    off = page.evaluate(link)
    switch.check()
    assert page.evaluate(density) == 2
    page.evaluate("davgswt.painting.undo()")
    assert page.evaluate(density) == 0 and not switch.is_checked()
    slider.focus()
    page.keyboard.press("ArrowRight")
    assert switch.is_checked() and page.evaluate(density) == 0.05
    with page.expect_download() as download:
        page.evaluate("(davgswt.painting.undo(), savePaint.click())")
    assert read_json(download.value.path())["densities"] == {"shrub": 0}
    again = visit(400, 400).open(f"{address}?still{SKY}&paint={off}")
    assert again.page.evaluate(density) == 0
    again.page.keyboard.press("m")
    box = again.page.get_by_role("checkbox", name="Shrub on grass")
    assert not box.is_checked()
    box.check()
    assert again.page.evaluate(density) == 1


@pytest.mark.slow
@pytest.mark.parametrize("unit, length", [("metre", "12 m"), ("flying height", "3 tiles")])
def test_the_legend_of_levels_says_how_far_each_reaches_and_what_is_loading(cover, visit, address, unit, length):
    manifest = read_json(cover / "page/davgswt.json")
    assert manifest["levels"][0]["distance"] == 3 * SIDE
    seen = visit(400, 300)
    seen.page.route("**/davgswt.json", lambda route: route.fulfill(json=manifest | {"unit": unit}))
    seen.open(f"{address}?still=1#1,1,2,0,-20&show=level")
    assert seen.state["shrink"] < 1
    seen.until("legend.innerText.includes('Finer levels are still loading')")
    entries = seen.page.locator("#legend li").all_inner_texts()
    assert entries == [f"level 0, finest: up to {length} away", "level 1, coarsest: beyond"]
    seen.page.evaluate("davgswt.settle()")
    seen.until("!legend.innerText.includes('loading')")
