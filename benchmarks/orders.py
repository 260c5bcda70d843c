"""What tau buys on a page: late frames, sorting, composing and memory of a walk, for several values of tau.

The worker's modules run in headless Chromium on a page's bundle: a walk of STEPS steps over some tiles, turning, at 60
frames a second: between two views the worker works ahead as long as a frame leaves it. A frame is late if a batch was
missing and another order stood in. Argument: a page folder.
"""

import sys
from pathlib import Path

import numpy as np
from fixtures.browser import chromium, chromium_path, served

from dav_gswt.bundle.manifest import read_manifest
from dav_gswt.bundle.orders import DirectionRings

STEPS, LENGTH, FRAME = 600, 12.0, 16.0  # steps of a walk of so many tiles; milliseconds of a frame
WALK = """async ({ orders, steps, length, frame }) => {
  const { createFrameBuilder } = await import("./worker/frame_builder.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { readManifest, readParts } = await import("./data/bundle.js");
  const { webSource } = await import("./data/source.js");
  const source = webSource(new URL("./", location.href)), manifest = await readManifest(source);
  manifest.tiles.forEach((tile, k) => (tile.orders = orders[k]));
  const heights = createHeights(manifest.heights), builder = createFrameBuilder(manifest, heights);
  await readParts(manifest, source, { take: (index, buffer) => builder.supply.addPart(index, buffer) });
  let lateFrames = 0, lacking = 0;
  const { tile_side: side, eye_floor: floor } = manifest;
  for (let k = 0; k <= steps; k++) {
    const along = length * side * k / steps;
    const at = { x: along, y: 0.3 * along, eye: 2 * floor, yaw: 40 + 60 * Math.sin(k / 40), pitch: -14 };
    const begun = performance.now(), made = builder.build(cameraAt(at, 1280, 720, heights), 1.5e6, k === 0);
    lateFrames += made.incomplete ? 1 : 0;
    lacking += made.missing.size ? 1 : 0;
    const left = frame - (performance.now() - begun);
    if (left > 0) builder.workAhead(left);
  }
  return { frames: steps + 1, lateFrames, lacking, ...builder.work };
}"""


def main() -> int:
    if len(sys.argv) < 2 or chromium_path() is None:
        print("orders: name a page folder (and install chromium); nothing measured")
        return 0
    folder = Path(sys.argv[1])
    manifest = read_manifest(folder)
    elevations = sorted({round(-float(np.degrees(np.arcsin(d[2]))), 6) for d in manifest.directions[:-1]})
    rings = DirectionRings(tuple(elevations), (len(manifest.directions) - 1) // len(elevations))
    spread = np.quantile([tile.uncertainty for tile in manifest.tiles], [0.25, 0.5, 0.75])
    with served(folder) as address, chromium() as browser:
        for tau in (0.0, *spread.tolist(), 1.0):
            page = browser.new_page()
            page.goto(f"{address}davgswt.json")
            orders = [rings.select_directions(tile.uncertainty, tau) for tile in manifest.tiles]
            found = page.evaluate(WALK, {"orders": orders, "steps": STEPS, "length": LENGTH, "frame": FRAME})
            told = ", ".join(f"{key} {value:,.0f}" for key, value in found.items())
            print(f"tau {tau:.3f}: {sum(map(len, orders))} orders; {told}")
            page.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
