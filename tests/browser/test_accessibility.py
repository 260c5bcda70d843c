"""Accessibility: axe-core finds nothing serious in any state of the page. It is pinned in package-lock.json."""

import shutil
import subprocess
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
AXE = FOLDER / "node_modules" / "axe-core" / "axe.min.js"
RUN = """async () => {
  const { violations } = await axe.run(document, { resultTypes: ["violations"] });
  return violations.map(({ id, impact, nodes }) => `${impact}: ${id}: ${nodes.map(node => node.target).join(" ")}`);
}"""


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


@pytest.mark.parametrize("width, height, touch", [(360, 640, True), (1280, 720, False)])
def test_nothing_is_wrong_in_any_state(visit, address, axe, width, height, touch):
    seen = visit(width, height, has_touch=touch, is_mobile=touch).open(address)
    seen.until("!hint.hidden")
    seen.page.evaluate(axe)
    found = {"first view": seen.page.evaluate(RUN)}
    for overlay in ("level", "uncertainty", "material"):
        seen.page.select_option("#overlay", overlay)
        found[overlay] = seen.page.evaluate(RUN)
    seen.page.locator("#compare").click()
    found["side by side"] = seen.page.evaluate(RUN)
    seen.page.locator("#menuButton").click()
    seen.page.locator("#photoButton").click()
    seen.page.evaluate("job.hidden = false")
    found["photo"] = seen.page.evaluate(RUN)
    seen.page.evaluate("job.hidden = true")
    seen.page.locator("#photoClose").click()
    for name in ("menu", "paint"):
        seen.page.locator(f"#{name}Button").click()
        found[name] = seen.page.evaluate(RUN)
    seen.page.locator("#paintClose").click()
    seen.page.keyboard.press("i")
    seen.page.keyboard.press("n")
    found["numbers"] = seen.page.evaluate(RUN)
    assert {state: faults for state, faults in found.items() if faults} == {}
