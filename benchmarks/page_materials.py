"""Time of updating and sorting a view of two materials with objects, against one material's, drawn as densely.

What `page.py` times for a ground of one material is timed here for two versions of the same ground: one material, and
two that meet in most cells, with shrubs. The worker's modules run in headless Chromium over the same hills; both are
given the budgets with which they draw the same number of Gaussians. Walks alternate between the versions, and of each
view the least time of all walks counts, as other work of the machine lengthens some. What is late for a view is made
between views and timed there ("between"). "All at once" is a walk that waits for every batch. Asserts nothing.
"""

import json
import statistics
import sys
import tempfile
from pathlib import Path

from fixtures import land_covers
from fixtures.browser import FLAGS, chromium_path, served
from fixtures.page_visit import VIEWER
from record import report_figures

from dav_gswt.bundle import build
from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.manifest import NAME
from dav_gswt.files import read_json
from dav_gswt.terrain.page import write_page

DISCS, LEVELS, BLADES = 100, 3, 64  # 10,000 Gaussians a tile, and some
BUDGET, WALKS = 600_000, 4
HEADERS = {
    "Content-Type": "text/html",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
}
TARGETS = {"page_two_materials_ratio": 1.5}
SETUP = """async () => {
  const { createFrameBuilder } = await import("./worker/frame_builder.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { createWalker } = await import("./ui/walker.js");
  const { readManifest, readParts } = await import("./data/bundle.js");
  const { chunkKey, listChunks } = await import("./data/layout.js");
  const { webSource } = await import("./data/source.js");
  const source = webSource(new URL("./", location.href)), parts = [];
  const manifest = await readManifest(source), side = manifest.tile_side;
  const heights = createHeights({ kind: "hills", height: 3 * side, wavelength: 20 * side, octaves: 4, salt: 1 });
  await readParts(manifest, source, { take: (...part) => void parts.push(part) });
  const camera = k => cameraAt(createWalker(manifest,
    { eye: 1, pitch: -8, yaw: 30 * Math.sin(k / 20), x: 0.05 * k * side, y: 0.02 * k * side }), 1920, 1080, heights);
  const begin = () => {
    const builder = createFrameBuilder(manifest, heights);
    for (const [index, buffer] of parts) builder.supply.addPart(index, buffer.slice());
    builder.supply.prepare(listChunks(manifest).map(({ tile, entry }) => chunkKey(tile, entry.level)));
    while (builder.supply.advance());
    return builder;
  };
  const countDrawn = ({ near, blocks }) => {
    let sum = near.length;
    for (let k = 1; k < blocks.length; k += 4) sum += ((blocks[k] >>> 16) & 63) + 1;
    return sum;
  };
  window.probe = budget => {
    const builder = begin(), counts = [60, 100, 140].map(k => countDrawn(builder.build(camera(k), budget, true)));
    return counts.reduce((a, b) => a + b) / counts.length;
  };
  window.walk = (budget, patient) => {
    const builder = begin(), views = [];
    let work = builder.work;
    for (let k = 0; k < 160; k++) {
      const frame = builder.build(camera(k), budget, patient), start = performance.now();
      if (!patient) builder.workAhead(5);
      const between = performance.now() - start, { update, sort } = frame.milliseconds, now = builder.work;
      const did = Object.fromEntries(Object.keys(now).map(name => [name, now[name] - work[name]]));
      work = now;
      const { near, cells } = frame, border = cells.filter(one => one.border).length;
      if (k >= 40) views.push({ update, sort, both: update + sort, between, ...did, drawn: countDrawn(frame),
        near: near.length, cells: cells.length, border });
    }
    return views;
  };
}"""


def content(materials: int) -> BundleContent:
    """The ground of `fixtures.land_covers`, finer: sand alone, or sand and grass with shrubs."""
    tiles = [
        land_covers.tile_set(colour, blades, DISCS, LEVELS)
        for colour, blades in ((land_covers.SAND, 0), (land_covers.GRASS, BLADES))
    ]
    both = land_covers.cover_content()
    if materials == 1:
        return BundleContent(tiles[:1], both.materials[:1])
    shrubs = [land_covers.shrub(levels=LEVELS)]
    return BundleContent(tiles, both.materials, shrubs, both.classes, both.scatter, both.probabilities)


def write_page_of(folder: Path, materials: int) -> Path:
    build.write_bundle(content(materials), folder / "bundle", build.BundleOptions(tau=0.5, salt=7), {})
    manifest = read_json(folder / "bundle" / NAME)
    for level in manifest["levels"][:-1]:
        level |= {"distance": 2 * land_covers.SIDE * 2 ** level["level"], "band": 0.1 * land_covers.SIDE}
    (folder / "bundle" / NAME).write_text(json.dumps(manifest | {"eye_floor": 0.5}))
    write_page(folder / "bundle", VIEWER, folder / "page")
    return folder / "page"


def main() -> int:
    path = chromium_path()
    if path is None:
        print("page of two materials: no chromium on this machine, nothing measured")
        return 0
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        pages = [write_page_of(Path(folder) / str(count), count) for count in (1, 2)]
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        with served(pages[0]) as first, served(pages[1]) as second:
            measure([open_tab(browser, address) for address in (first, second)])
        browser.close()
    return 0


def open_tab(browser, address: str):
    """A tab that shows no page and has what `SETUP` defines; isolated, else its clock has steps of 0.1 ms."""
    tab = browser.new_page()
    tab.route("**/blank.html", lambda route: route.fulfill(body="<!doctype html>", headers=HEADERS))
    tab.goto(f"{address}blank.html")
    tab.evaluate(SETUP)
    return tab


def measure(tabs: list) -> None:
    budgets = match_budgets(tabs)
    ratios = {}
    for patient, name in ((False, "view by view"), (True, "all at once")):
        act = f"budget => walk(budget, {str(patient).lower()})"
        walks = [[tab.evaluate(act, budget) for tab, budget in zip(tabs, budgets, strict=True)] for _ in range(WALKS)]
        medians = [summarize([walk[m] for walk in walks]) for m in range(len(tabs))]
        for count, found in zip(("one material", "two materials"), medians, strict=True):
            times = ", ".join(f"{key} {found[key]:.2f}" for key in ("update", "sort", "both", "between"))
            counts = ", ".join(f"{found[key]:,.0f} {key}" for key in ("drawn", "near", "cells", "border"))
            works = ", ".join(f"{found[key]:,.0f} {key}" for key in ("tested", "sorted"))
            print(f"  {name}, {count}: ms {times}; {counts}; new in a view: {works}")
        ratios[patient] = medians[1]["both"] / medians[0]["both"]
    print(f"  ratio all at once: {ratios[True]:.2f}")
    report_figures({"page_two_materials_ratio": ratios[False]}, TARGETS)


def match_budgets(tabs: list) -> list[float]:
    """Budgets with which all draw as many Gaussians as the one that draws least with `BUDGET`."""
    budgets = [float(BUDGET)] * len(tabs)
    for _ in range(3):
        drawn = [tab.evaluate("budget => probe(budget)", budget) for tab, budget in zip(tabs, budgets, strict=True)]
        budgets = [budget * min(drawn) / count for budget, count in zip(budgets, drawn, strict=True)]
    return budgets


def summarize(walks: list[list[dict]]) -> dict[str, float]:
    """Medians over the views of a walk: of the least times of all walks, and of the counts."""
    views = [{key: min(view[key] for view in same) for key in same[0]} for same in zip(*walks, strict=True)]
    return {key: statistics.median(view[key] for view in views) for key in views[0]}


if __name__ == "__main__":
    sys.exit(main())
