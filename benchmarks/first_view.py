"""What somebody waits for who opens the page of the default scene: a sharp picture, live terrain, the finest picture.

In headless Chromium with software rendering, 1280 x 720, from a local server, a new browser each time. Sharp: the still
is painted. Live: the first picture of the terrain itself is drawn. Drawn: all tiles of the first view are drawn at
their level, here and over a line of 20 Mbit/s and 40 ms. Whole: the finest picture at rest is shown; its PSNR is to the
library's still of the same place, without what lies over the picture. Medians of VISITS, of PSNR the worst; asserts
nothing. With a folder as its argument: of the page in that folder.
"""

import statistics
import sys
from pathlib import Path

import numpy as np
from fixtures.browser import chromium, chromium_path, served
from fixtures.page_visit import Visit
from record import report_figures

from dav_gswt.bundle import store
from dav_gswt.images.metrics import psnr
from dav_gswt.paths import RESULTS
from dav_gswt.terrain import endless, stills

SCENE = "desert"
SIZE = {"width": 1280, "height": 720}
VISITS, LONGEST = 3, 300  # seconds
SLOW = {"offline": False, "latency": 40, "downloadThroughput": 20e6 / 8, "uploadThroughput": 20e6 / 8}
TARGETS = {
    "page_sharp_seconds": 1.5,
    "page_live_seconds": 4.0,
    "page_drawn_seconds": 4.0,
    "page_whole_seconds": 60.0,
    "page_slow_drawn_seconds": 5.0,
    "page_whole_psnr": 38.0,
}
WATCH = """
  // seconds: the still stood in a frame that was painted
  window.seen = {};
  const look = () => {
    const first = document.getElementById("first");
    if (!seen.sharp && first?.complete && first.naturalWidth) seen.sharp = true;
    else if (seen.sharp === true) seen.sharp = performance.now() / 1000;
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
"""
LIVE = """async () => {
  if (document.readyState === "loading") await new Promise((done) => addEventListener("DOMContentLoaded", done));
  const { viewer } = await import("./main.js"), next = () => new Promise(requestAnimationFrame);
  while (!viewer?.scene?.frame?.count) await next();
  await next();
  const live = performance.now() / 1000;
  while (!viewer.loaded || viewer.scene.frame.missing.length) await next();
  await next();
  return [live, performance.now() / 1000];
}"""


def main() -> int:
    found = sorted(Path(RESULTS, SCENE).glob("seed*/**/terrain/page"), key=lambda page: page.stat().st_mtime)
    pages = [Path(path) for path in sys.argv[1:]] or found[-1:]
    if not pages or chromium_path() is None:
        print(f"first view: no chromium, or no page of {SCENE} (make run SCENE={SCENE}); nothing measured")
        return 0
    with served(pages[0]) as address:
        visits = [visit_page(address) for _ in range(VISITS)]
        slow = statistics.median(draw_slowly(address) for _ in range(VISITS))
    middle = [statistics.median(times) for times in zip(*(times for times, _ in visits), strict=True)]
    terrain = endless.terrain_from_bundle(bundle := store.read_bundle(pages[0]), {"kind": "flat"})
    still = np.clip(stills.render_shot(terrain, stills.SHOTS[0], bundle.manifest, **SIZE), 0, 1)
    worst = min(psnr(seen / 255, still.astype(float), np.ones(still.shape[:2])) for _, seen in visits)
    report_figures(dict(zip(TARGETS, [*middle, slow, worst], strict=True)), TARGETS)
    return 0


def visit_page(address: str) -> tuple[list[float], np.ndarray]:
    """Seconds after the start of the visit when sharp, live, drawn and whole, and the picture that is shown then."""
    with chromium() as browser:
        page = browser.new_page(viewport=SIZE)
        page.add_init_script(WATCH)
        page.goto(address, wait_until="commit")
        drawn = page.evaluate(LIVE)
        times = [page.evaluate("seen.sharp"), *drawn]
        visit = Visit(page)
        page.evaluate("import('./test_api.js').then(() => 0)")
        visit.until("davgswt.state.whole", LONGEST)
        times.append(page.evaluate("performance.now() / 1000"))
        seen = visit.decode(*page.evaluate("davgswt.grab()"))
    print("  sharp {:.2f} s, live {:.2f} s, drawn {:.2f} s, whole {:.1f} s".format(*times))
    return times, seen


def draw_slowly(address: str) -> float:
    """Seconds after the start of a visit over a slow line until all tiles of the first view are drawn."""
    with chromium() as browser:
        page = browser.new_page(viewport=SIZE)
        session = page.context.new_cdp_session(page)
        session.send("Network.enable")
        session.send("Network.emulateNetworkConditions", SLOW)
        page.goto(address, wait_until="commit")
        seconds = page.evaluate(LIVE)[1]
    print(f"  over a slow line: drawn {seconds:.2f} s")
    return seconds


if __name__ == "__main__":
    sys.exit(main())
