"""The first view and what lies behind it: still, accessibility, keyboard, sharing."""

import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
SIZES = [(360, 640, True), (1280, 720, False)]
FOLDER = Path(__file__).parent
AXE = FOLDER / "node_modules" / "axe-core" / "axe.min.js"  # pinned in package-lock.json
RUN_AXE = """async () => {
  const { violations } = await axe.run(document, { resultTypes: ["violations"] });
  return violations.map(({ id, impact, nodes }) => `${impact}: ${id}: ${nodes.map(node => node.target).join(" ")}`);
}"""


def test_a_still_is_shown_until_the_terrain_is_as_sharp(visit, fronted):
    seen = visit(320, 180, reduced_motion="reduce")
    held = []
    seen.page.route("**/parts/*", lambda route: held.append(route))
    seen.open(fronted, wait=False)
    seen.until("document.getElementById('first')?.complete")
    box = seen.page.locator("#first").bounding_box()
    assert (box["x"], box["y"], box["width"], box["height"]) == (0, 0, 320, 180)
    while held or not seen.state["whole"]:
        if held:
            held.pop().continue_()
        seen.page.wait_for_timeout(5)
    seen.until("!document.getElementById('first')")
    seen.open(f"{fronted}?still#3,5,2,20,-30", wait=False)
    assert not seen.page.locator("#first").is_visible(), "it is of another place"


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
def test_nothing_is_inaccessible_in_any_state(visit, address, axe, width, height, touch):
    seen, faults = visit(width, height, has_touch=touch, is_mobile=touch).open(address), {}
    seen.until("!hint.hidden")
    seen.page.evaluate(axe)

    def check(state: str) -> None:
        faults[state] = seen.page.evaluate(RUN_AXE)

    def click(name: str) -> None:
        seen.page.locator(f"#{name}").click()

    check("first view")
    seen.page.select_option("#overlay", "level")
    check("overlay")
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


def test_a_place_is_shared_as_a_link_and_a_picture_saved(visit, fronted, slow_device):
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
    assert download.value.suggested_filename == "my-meadow.png"
    assert seen.state["whole"]
