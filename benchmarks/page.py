"""Time of the page to load and order a synthetic bundle of 200k Gaussians, and to update, sort and draw a picture.

In headless Chromium with software rendering; prints a table, asserts nothing. Drawing in software is slow by nature:
the numbers that carry over to other machines are those of loading, and of updating and sorting (the worker's part).
Recorded is the median of update and sort together over hills: other work of the machine lengthens some frames.
"""

import statistics
import sys

from fixtures import bundles
from fixtures.browser import FLAGS, chromium_path
from pages import page_of
from record import report_figures

GROUND = bundles.Ground(discs=100, levels=3, speckle=20)  # 16 tiles x (100^2 + 50^2 + 25^2) = 210,000
VISITS = 5
TARGETS = {"terrain_update_ms": 4.0}
LOAD = """async () => {
  const { ready } = await import("./main.js");
  await ready;
  return performance.now();
}"""
UPDATE = """async hills => {
  // what the worker does for each view, timed here: a walk on a fixed path, 97 x 97 cells about the eye
  const { createFrameBuilder } = await import("./worker/frame_builder.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { createWalker } = await import("./ui/walker.js");
  const { readManifest, readParts } = await import("./data/bundle.js");
  const { chunkKey, listChunks } = await import("./data/layout.js");
  const { webSource } = await import("./data/source.js");
  const source = webSource(new URL("./", location.href)), manifest = await readManifest(source);
  const side = manifest.tile_side;
  const surface = { kind: "hills", height: 3 * side, wavelength: 20 * side, octaves: 4, salt: 1 };
  const heights = createHeights(hills ? surface : undefined), builder = createFrameBuilder(manifest, heights);
  await readParts(manifest, source, { take: (index, buffer) => builder.supply.addPart(index, buffer) });
  builder.supply.prepare(listChunks(manifest).map(({ tile, entry }) => chunkKey(tile, entry.level)));
  while (builder.supply.advance());
  const times = { update: [], sort: [], both: [] };
  let seen;
  for (let k = 0; k < 160; k++) {
    const place = { eye: 1, pitch: -8, yaw: 30 * Math.sin(k / 20), x: 0.05 * k * side, y: 0.02 * k * side };
    seen = builder.build(cameraAt(createWalker(manifest, place), 1920, 1080, heights), 1e6, false);
    if (k < 40) continue;
    const { update: chosen, sort } = seen.milliseconds;
    for (const [name, t] of [["update", chosen], ["sort", sort], ["both", chosen + sort]]) times[name].push(t);
  }
  return { times, tiles: seen.cells.length, count: seen.count, near: seen.near.length };
}"""
DRAW = """async () => {
  const { viewer } = await import("./main.js");
  await viewer.settle();
  const gl = document.getElementById("picture").getContext("webgl2"), pixel = new Uint8Array(4);
  const start = performance.now();
  viewer.drawFrame();
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return [performance.now() - start, viewer.state().count];
}"""


def main() -> int:
    path = chromium_path()
    if path is None:
        print("page: no chromium on this machine, nothing measured")
        return 0
    from playwright.sync_api import sync_playwright

    with page_of(GROUND) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        measure(browser, address)
        browser.close()
    return 0


def measure(browser, address: str) -> None:
    loads, draws = [], []
    for _ in range(VISITS):
        with browser.new_context(viewport={"width": 480, "height": 270}) as context:
            tab = context.new_page()
            tab.goto(f"{address}?still#2,2,1,60,-20", wait_until="domcontentloaded")
            loads.append(tab.evaluate(LOAD))
            draws.append(tab.evaluate(DRAW))
    with browser.new_context(viewport={"width": 160, "height": 100}) as context:
        tab = context.new_page()
        tab.goto(f"{address}?still")
        made = {hills: tab.evaluate(UPDATE, hills) for hills in (False, True)}
    report("all tiles ready, s after the request", [ms / 1e3 for ms in loads])
    report(f"one picture 480 x 270 in software, {draws[0][1]:,} splats, ms", [ms for ms, _ in draws])
    for hills, found in made.items():
        where = f"{'hills' if hills else 'level'}, {found['tiles']} of 97 x 97 tiles, {found['count']:,} splats"
        for name, times in found["times"].items():
            report(f"{name} ({found['near']:,} sorted), {where}, ms", times)
    report_figures({"terrain_update_ms": statistics.median(made[True]["times"]["both"])}, TARGETS)


def report(what: str, values: list[float]) -> None:
    mean, middle, sd = statistics.mean(values), statistics.median(values), statistics.stdev(values)
    print(f"  {what:84} {mean:8.2f} (sd {sd:.2f}, median {middle:.2f}, max {max(values):.2f})")


if __name__ == "__main__":
    sys.exit(main())
