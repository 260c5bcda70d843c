"""The first view and what lies behind it: name, still and hint, layout and accessibility, keyboard and touch."""

import shutil
import subprocess
from pathlib import Path

import pytest
from fixtures.bundles import Ground

from dav_gswt.study.terrain.browser import served

pytestmark = pytest.mark.slow
SIZES = [(360, 640, True), (844, 390, True), (1280, 720, False)]
FOLDER = Path(__file__).parent
AXE = FOLDER / "node_modules" / "axe-core" / "axe.min.js"  # pinned in package-lock.json
RUN_AXE = """async () => {
  const { violations } = await axe.run(document, { resultTypes: ["violations"] });
  return violations.map(({ id, impact, nodes }) => `${impact}: ${id}: ${nodes.map(node => node.target).join(" ")}`);
}"""
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


def test_the_name_and_a_line_are_there_without_any_script(visit, fronted):
    seen = visit(480, 300, java_script_enabled=False)
    seen.page.goto(fronted)
    assert seen.page.title() == "My meadow · From 7 photos"
    assert seen.page.get_by_role("heading", name="My meadow").is_visible()
    assert seen.page.locator("#first").is_visible()


def test_a_still_is_shown_until_the_terrain_is_as_sharp(visit, fronted):
    seen = visit(320, 180, reduced_motion="reduce")
    held = []
    seen.page.route("**/chunks/*", lambda route: held.append(route))
    seen.open(fronted, wait=False)
    seen.until("document.getElementById('first')?.complete")
    box = seen.page.locator("#first").bounding_box()
    assert (box["x"], box["y"], box["width"], box["height"]) == (0, 0, 320, 180)
    assert seen.page.evaluate("getComputedStyle(document.getElementById('first')).transitionDuration") == "0s"
    while held or not seen.state["whole"]:
        if held:
            held.pop().continue_()
        seen.page.wait_for_timeout(5)
    seen.until("!document.getElementById('first')")
    seen.open(f"{fronted}?still#3,5,2,20,-30", wait=False)
    assert not seen.page.locator("#first").is_visible(), "it is of another place"


def test_the_first_step_takes_name_hint_and_still_away(visit, fronted):
    seen = visit(480, 300).open(fronted)
    seen.until("!hint.hidden")
    assert "to walk" in seen.page.locator("#hint").inner_text()
    seen.page.keyboard.down("w")
    seen.until("hint.hidden && !document.getElementById('first')")
    seen.page.keyboard.up("w")
    seen.page.locator("#title").wait_for(state="hidden")
    seen.page.locator("#menuButton").click()  # where it is said again
    assert seen.page.locator("#about").inner_text() == "My meadow: From 7 photos"


def test_walking_closes_the_menu(visit, fronted):
    seen = visit(480, 300).open(fronted)
    seen.page.locator("#menuButton").click()
    assert seen.page.locator("#menu").is_visible()
    seen.page.keyboard.down("w")
    seen.page.locator("#menu").wait_for(state="hidden")
    seen.page.keyboard.up("w")


@pytest.fixture(scope="module")
def axe():
    """The source of axe-core."""
    if not AXE.exists():
        if not shutil.which("npm"):
            pytest.skip("needs npm (Node.js 20 or newer) for axe-core")
        install = ["npm", "install", "--no-save", "--no-audit", "--no-fund"]
        done = subprocess.run(install, cwd=FOLDER, capture_output=True, text=True, timeout=300)
        if not AXE.exists():
            pytest.skip(f"npm install --prefix tests/browser does not work here: {done.stderr[-300:]}")
    return AXE.read_text()


@pytest.mark.parametrize("width, height, touch", SIZES)
def test_nothing_is_cut_off_small_covered_or_inaccessible_in_any_state(visit, address, axe, width, height, touch):
    seen, faults = visit(width, height, has_touch=touch, is_mobile=touch).open(address), {}
    seen.until("!hint.hidden")
    seen.page.evaluate(axe)

    def check(state: str) -> None:
        faults[state] = seen.page.evaluate(LAYOUT) + seen.page.evaluate(RUN_AXE)

    def click(name: str) -> None:
        seen.page.locator(f"#{name}").click()

    check("first view")
    for overlay in ("level", "uncertainty", "material"):
        seen.page.select_option("#overlay", overlay)
        check(overlay)
    click("compare")
    check("side by side")
    click("compare")
    click("menuButton")
    click("photoButton")
    seen.page.evaluate("job.hidden = false")
    check("photo under way")
    seen.page.evaluate("job.hidden = true")
    check("photo")
    click("photoClose")
    click("menuButton")
    check("menu")
    click("mapButton")
    click("menuClose")
    check("map")
    click("menuButton")
    click("paintButton")
    check("materials")
    assert {state: found for state, found in faults.items() if found} == {}


def test_everything_is_reached_with_the_tab_key_and_escape_returns(visit, fronted):
    seen = visit(640, 400).open(fronted)
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


def test_a_place_is_shared_as_a_link_and_a_picture_saved_with_its_progress(visit, fronted, slow_device):
    seen = visit(480, 300, permissions=["clipboard-read", "clipboard-write"])
    seen.page.add_init_script(slow_device)
    seen.open(fronted)
    seen.page.evaluate("davgswt.set({ x: 3, y: 5, eye: 2, yaw: 20, pitch: -30 })")
    seen.page.locator("#copyLink").click()
    seen.until("toast.textContent.includes('copied')")
    link = seen.page.evaluate("navigator.clipboard.readText()")
    assert link.startswith(fronted + "#3.0") and ",20.000,-30.000" in link
    with seen.page.expect_download(timeout=60_000) as download:
        seen.page.evaluate("(davgswt.set({ x: 9 }), keep.click())")
        seen.until("keep.getAttribute('aria-busy') === 'true' && /Saving the picture: \\d+ %/.test(toast.textContent)")
    assert download.value.suggested_filename == "my-meadow.png"
    assert seen.state["whole"]
    seen.until("keep.getAttribute('aria-busy') === null && toast.textContent === 'The picture is saved.'")


def test_an_overlay_tells_what_is_under_the_pointer(visit, page_of):
    def edit(manifest):
        for tile in manifest["tiles"]:
            tile["uncertainty"] = 0.02 + 0.001 * tile["tile"]

    with served(page_of(Ground(), edit=edit)) as address:
        seen = visit(480, 300).open(f"{address}?still#2,2,1,0,-90")
        seen.page.mouse.move(240, 120)
        seen.page.evaluate("davgswt.overlay('uncertainty')")  # under a pointer at rest
        legend = seen.page.locator("#legend")
        tile = seen.state["under"]["tile"]
        seen.until(f"legend.textContent.includes('tile {tile}, uncertainty {0.02 + 0.001 * tile:.3f}, level 0')")
        assert "0.020, sure" in legend.inner_text() and "0.035, unsure" in legend.inner_text()
        seen.page.select_option("#overlay", "level")
        assert "level 0, finest: up to" in legend.inner_text() and "beyond" in legend.inner_text()
        seen.page.evaluate("davgswt.set({pitch: 60})")
        seen.page.mouse.move(240, 130)
        assert "No tile here" in legend.inner_text()
