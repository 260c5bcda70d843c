"""How much memory the page takes for a made-up set of 1.5M Gaussians, all read and drawn, beyond an empty tab's.

In headless Chromium with software rendering, where what a graphics card would hold lies in memory, too: the sum over
the tab's process and the one that draws, of pages that no other process shares. Prints figures, asserts nothing.
"""

import sys
import time

import made_up
import psutil
from pages import page_of
from record import tell

from dav_gswt.terrain.browser import FLAGS, chromium_path

GROUND = made_up.Ground(discs=264, levels=6, speckle=20)
TARGETS = {"page_memory_mb": 300.0}
KINDS = {"renderer": "the tab", "gpu-process": "what draws"}
SHOW = """async () => {
  while (!window.davgswt) await new Promise(done => setTimeout(done, 5));
  await davgswt.ready;
  for (const yaw of [60, 150, 240, 330]) {
    davgswt.set({ yaw });
    await davgswt.settle();
  }
  return davgswt.state.count;
}"""


def main() -> int:
    path = chromium_path()
    if path is None:
        print("memory: no chromium on this machine, nothing measured")
        return 0
    from playwright.sync_api import sync_playwright

    with page_of(GROUND) as address, sync_playwright() as playwright:
        empty = measured(playwright, path, "about:blank")
        full = measured(playwright, path, f"{address}?still#2,2,1,60,-20", SHOW)
    for kind, name in KINDS.items():
        print(f"  {name}: {full[kind]:.0f} MB, empty {empty[kind]:.0f} MB")
    tell({"page_memory_mb": sum(full.values()) - sum(empty.values())}, TARGETS)
    return 0


def measured(playwright, path: str, address: str, script: str = "() => 0") -> dict[str, float]:
    """Megabytes that only these processes of a new browser hold, a while after the page has run a script."""
    browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
    tab = browser.new_page(viewport={"width": 480, "height": 270})
    tab.goto(address)
    tab.evaluate(script)
    time.sleep(3)  # what was needed to read only is given back meanwhile
    found = dict.fromkeys(KINDS, 0.0)
    for process in psutil.Process().children(recursive=True):
        kind = next((kind for kind in KINDS if f"--type={kind}" in process.cmdline()), None)
        if kind:
            found[kind] += process.memory_full_info().uss / 1e6
    browser.close()
    return found


if __name__ == "__main__":
    sys.exit(main())
