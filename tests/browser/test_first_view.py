"""The first view and what lies behind it: name, still and hint, layout at four sizes, keyboard and touch."""

import json

import numpy as np
import pytest
from fixtures import bundles
from fixtures.page_visit import VIEWER

from dav_gswt.images.jpeg import encode_jpeg
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.page_front import Front

SIZES = [(360, 640, True), (844, 390, True), (1280, 720, False), (2560, 1440, False)]
LAYOUT = """() => {
  // boxes of what may be pressed, and of what shows text, with what is wrong with them
  const { innerWidth: wide, innerHeight: high } = window, faults = [], seen = [];
  const visible = element => element.checkVisibility({ checkOpacity: true, checkVisibilityCSS: true });
  const all = "button, select, summary, input, #title, #hint, #legend, #toast, #map, #job, .panel";
  for (const element of document.querySelectorAll(all)) {
    if (!visible(element) || element.type === "file") continue;
    const box = element.getBoundingClientRect(), name = element.id || element.textContent;
    const scrolls = element.closest(".panel") && !element.matches(".panel");
    const inside = scrolls || (box.top >= 0 && box.bottom <= high);
    if (box.left < 0 || box.right > wide || !inside) faults.push(`${name} is cut off`);
    const small = Math.min(box.width, box.height) < 44;
    if (small && element.matches("button, select, summary")) faults.push(`${name}: ${box.width} x ${box.height}`);
    if (element.scrollWidth > element.clientWidth + 1) faults.push(`${name} overflows`);
    if (!scrolls) seen.push([name, box, element]);
  }
  for (const [a, one, first] of seen) for (const [b, two, second] of seen) {
    if (a >= b || first.contains(second) || second.contains(first)) continue;
    if ([first, second].some(one => one.matches(".panel") || one.closest("#job"))) continue; // they cover
    const across = Math.min(one.right, two.right) - Math.max(one.left, two.left);
    const down = Math.min(one.bottom, two.bottom) - Math.max(one.top, two.top);
    if (across > 1 && down > 1) faults.push(`${a} covers ${b}`);
  }
  return faults;
}"""


@pytest.fixture(scope="module")
def fronted(tmp_path_factory):
    """The address of a page with a front; its still is magenta."""
    folder = tmp_path_factory.mktemp("fronted")
    bundles.write_bundle(folder / "bundle", bundles.Ground())
    still = encode_jpeg(np.full((90, 160, 3), [1.0, 0.0, 1.0]), 80)
    write_page(folder / "bundle", VIEWER, folder / "page", front=Front("My meadow", "From 7 photos", still))
    with served(folder / "page") as address:
        yield address


def open_at(visit, address, width, height, touch, **options):
    return visit(width, height, has_touch=touch, is_mobile=touch, **options).open(address)


def test_the_name_and_a_line_are_there_without_any_script(visit, fronted):
    seen = visit(480, 300, java_script_enabled=False)
    seen.page.goto(fronted)
    assert seen.page.title() == "My meadow · From 7 photos"
    assert seen.page.get_by_role("heading", name="My meadow").is_visible()
    assert seen.page.locator("#first").is_visible()


def test_a_still_is_shown_until_the_terrain_is_as_sharp(visit, fronted):
    seen = visit(320, 180)
    held = []
    seen.page.route("**/chunks/*", lambda route: held.append(route))
    seen.open(fronted, wait=False)
    seen.until("document.getElementById('first')?.complete")
    box = seen.page.locator("#first").bounding_box()
    assert (box["x"], box["y"], box["width"], box["height"]) == (0, 0, 320, 180)
    while held or not seen.state["whole"]:
        if held:
            held.pop().continue_()
        seen.page.wait_for_timeout(5)
    seen.until("!document.getElementById('first')")


@pytest.mark.parametrize("where", ["#3,5,2,20,-30", "?still"])
def test_elsewhere_the_still_is_not_shown(visit, fronted, where):
    seen = visit(320, 180)
    seen.open(fronted + where, wait=False)
    assert not seen.page.locator("#first").is_visible()


def test_the_first_step_takes_name_hint_and_still_away(visit, fronted):
    seen = open_at(visit, fronted, 480, 300, False)
    seen.until("!hint.hidden")
    assert "to walk" in seen.page.locator("#hint").inner_text()
    seen.page.keyboard.down("w")
    seen.until("hint.hidden && !document.getElementById('first')")
    seen.page.keyboard.up("w")
    seen.page.locator("#title").wait_for(state="hidden")
    seen.page.locator("#menuButton").click()  # where it is said again
    assert seen.page.locator("#about").inner_text() == "My meadow: From 7 photos"


def test_walking_closes_the_menu(visit, fronted):
    seen = open_at(visit, fronted, 480, 300, False)
    seen.page.locator("#menuButton").click()
    assert seen.page.locator("#menu").is_visible()
    seen.page.keyboard.down("w")
    seen.page.locator("#menu").wait_for(state="hidden")
    seen.page.keyboard.up("w")


@pytest.mark.parametrize("touch", [False, True])
def test_help_speaks_of_what_the_device_has(visit, fronted, touch):
    seen = open_at(visit, fronted, 480, 600, touch)
    button = seen.page.locator("#menuButton")
    button.tap() if touch else button.click()
    text = seen.page.locator("#menu").inner_text()
    assert ("pinch" in text) == touch and ("wheel" in text) == (not touch)
    assert seen.page.locator("#pad").is_visible() == touch


@pytest.mark.parametrize("width, height, touch", SIZES)
def test_nothing_is_cut_off_small_or_covered(visit, address, width, height, touch):
    seen = open_at(visit, address, width, height, touch)
    seen.until("!hint.hidden")
    faults = {"first view": seen.page.evaluate(LAYOUT)}
    for overlay in ("level", "uncertainty", "material"):
        seen.page.select_option("#overlay", overlay)
        faults[overlay] = seen.page.evaluate(LAYOUT)
    seen.page.locator("#compare").click()
    faults["side by side"] = seen.page.evaluate(LAYOUT)
    seen.page.locator("#compare").click()
    seen.page.locator("#menuButton").click()
    seen.page.locator("#photoButton").click()
    faults["photo mode"] = seen.page.evaluate(LAYOUT)
    seen.page.evaluate("job.hidden = false")
    faults["photo under way"] = seen.page.evaluate(LAYOUT)
    seen.page.evaluate("job.hidden = true")
    seen.page.locator("#photoClose").click()
    seen.page.locator("#menuButton").click()
    faults["menu"] = seen.page.evaluate(LAYOUT)
    seen.page.locator("#mapButton").click()
    seen.page.locator("#menuClose").click()
    faults["map"] = seen.page.evaluate(LAYOUT)
    seen.page.locator("#menuButton").click()
    seen.page.locator("#paintButton").click()
    faults["materials"] = seen.page.evaluate(LAYOUT)
    assert {state: found for state, found in faults.items() if found} == {}


def test_everything_is_reached_with_the_tab_key_and_escape_returns(visit, fronted):
    seen = open_at(visit, fronted, 640, 400, False)
    reached = []
    for _ in range(6):
        seen.page.keyboard.press("Tab")
        reached.append(seen.page.evaluate("document.activeElement.id"))
    assert [name for name in reached if name] == ["picture", "overlay", "keep", "copyLink", "menuButton"]
    seen.page.locator("#menuButton").focus()
    seen.page.keyboard.press("Enter")
    assert seen.page.evaluate("document.activeElement.id") == "menu"
    seen.page.keyboard.press("Tab")
    assert seen.page.evaluate("document.activeElement.id") == "menuClose"
    seen.page.keyboard.press("Escape")
    assert not seen.page.locator("#menu").is_visible()
    assert seen.page.evaluate("document.activeElement.id") == "menuButton"


def test_nothing_moves_where_people_ask_for_that(visit, fronted):
    seen = visit(320, 180, reduced_motion="reduce")
    seen.page.goto(fronted)
    read = "document.getElementById('first') && getComputedStyle(document.getElementById('first')).transitionDuration"
    assert seen.page.evaluate(read) in ("0s", None)


def test_a_place_is_shared_as_a_link(visit, fronted):
    seen = visit(480, 300, permissions=["clipboard-read", "clipboard-write"]).open(fronted)
    seen.at(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
    seen.page.locator("#copyLink").click()
    seen.until("toast.textContent.includes('copied')")
    link = seen.page.evaluate("navigator.clipboard.readText()")
    assert link.startswith(fronted + "#3.0") and ",20.000,-30.000" in link


def test_saving_a_picture_says_how_far_it_is_and_is_of_the_finest(visit, fronted):
    seen = visit(480, 300)
    seen.page.add_init_script(
        """const ask = WebGL2RenderingContext.prototype.getSyncParameter, born = new WeakMap();
        WebGL2RenderingContext.prototype.getSyncParameter = function (sync, name) { // a slow device
          if (!born.has(sync)) born.set(sync, performance.now());
          return performance.now() - born.get(sync) < 150 ? this.UNSIGNALED : ask.call(this, sync, name);
        };"""
    )
    seen.open(fronted)
    with seen.page.expect_download(timeout=60_000) as download:
        seen.page.locator("#keep").click()
        seen.until("keep.getAttribute('aria-busy') === 'true' && /Saving the picture: \\d+ %/.test(toast.textContent)")
    assert download.value.suggested_filename == "my-meadow.png"
    assert seen.state["whole"]
    seen.until("keep.getAttribute('aria-busy') === null && toast.textContent === 'The picture is saved.'")


def test_an_overlay_tells_what_is_under_the_pointer(visit, page_of):
    folder = page_of(bundles.Ground())
    manifest = json.loads((folder / "davgswt.json").read_text())
    for tile in manifest["tiles"]:
        tile["uncertainty"] = 0.02 + 0.001 * tile["tile"]
    (folder / "davgswt.json").write_text(json.dumps(manifest))
    with served(folder) as address:
        seen = visit(480, 300).open(f"{address}?still#2,2,1,0,-90")
        seen.page.select_option("#overlay", "uncertainty")
        legend = seen.page.locator("#legend")
        assert "0.020, sure" in legend.inner_text() and "0.035, unsure" in legend.inner_text()
        seen.page.mouse.move(240, 120)
        tile = seen.state["under"]["tile"]
        assert f"tile {tile}, uncertainty {0.02 + 0.001 * tile:.3f}, level 0" in legend.inner_text()
        seen.page.select_option("#overlay", "level")
        assert "level 0, finest: up to" in legend.inner_text() and "beyond" in legend.inner_text()
        seen.page.evaluate("davgswt.set({pitch: 60})")
        seen.page.mouse.move(240, 130)
        assert "No tile here" in legend.inner_text()
        seen.page.select_option("#overlay", "picture")
        assert not legend.is_visible()
