"""Time of a frame by the page beside Spark and PlayCanvas, which draw the same splats in the same browser.

The Gaussians that the page shows of a view are written as a PLY around the eye, for the others. Each renderer turns the
eye back and forth by some thousandths of a degree and is timed until a pixel can be read. In headless Chromium; in
software, where ratios carry over and milliseconds do not, or with `--gpu` on a graphics card, at 1920 x 1080. Prints a
table, asserts nothing.

`python study/benchmarks/page_peers.py BUNDLE [--gpu] [RENDERER ...]`: by default all; they come by `npm ci` in
study/benchmarks/peers. In software Spark takes seconds for a frame, so a quarter of
an hour for all; without it two minutes.
"""

import functools
import http.server
import statistics
import sys
import tempfile
import threading
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from fixtures.browser import FLAGS, chromium_path, served
from fixtures.page_visit import VIEWER
from record import report_figures

from dav_gswt.bundle import store
from dav_gswt.field import concatenate_fields, write_field
from dav_gswt.images.metrics import mse_to_psnr
from dav_gswt.raster import render
from dav_gswt.terrain import endless, stills, visibility
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.placement import group_by_cell, place_cell
from dav_gswt_study.terrain.frames import VISIT

GPU = "--gpu" in sys.argv
GPU_FLAGS = [  # Chromium's way to a graphics card without a screen
    "--headless",
    "--no-sandbox",
    "--use-angle=gl-egl",  # by Vulkan it wants extensions that need a screen
    "--ignore-gpu-blocklist",
    "--disable-gpu-watchdog",
    "--no-first-run",
]
PEERS = Path(__file__).parent / "peers"
WIDTH, HEIGHT = (1920, 1080) if GPU else (640, 360)  # pixels
FIELD = 60.0  # degrees across
# Gaussians in view; the most is more than the views need, so that all renderers show the same ones
BUDGETS = (50_000, 100_000, 200_000, 400_000) if GPU else (400_000,)
SHOT = stills.Shot("walker", (0.5, 0.5), 1.0, 12.0, 60.0)
ROUNDS, FRAMES, WARM_UP = 3, 9, 4
TURNS = [0.002 * (-1) ** k for k in range(FRAMES)]  # degrees: the same Gaussians stay in view
OTHERS = ("spark", "playcanvas")
PEER = """async ({ name, fov, width, height, ahead }) => {
  const { open } = await import(`./${name}.js`);
  window.peer = await open({ width, height, fov });
  for (let k = 0; k < 40; k++) { // splats are sorted beside the frames
    window.peer.draw(ahead[k % ahead.length]);
    await new Promise((done) => setTimeout(done, 50));
  }
}"""
TIME_PEER = """async ({ ahead, before }) => {
  const { peer } = window, pixel = new Uint8Array(4), times = [];
  for (let k = -before; k < ahead.length; k++) {
    await new Promise((done) => requestAnimationFrame(done));
    const start = performance.now();
    peer.draw(ahead[Math.max(k, 0)]);
    peer.gl.readPixels(0, 0, 1, 1, peer.gl.RGBA, peer.gl.UNSIGNED_BYTE, pixel);
    if (k >= 0) times.push(performance.now() - start);
  }
  return times;
}"""
RENDERER = """() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  return gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info").UNMASKED_RENDERER_WEBGL);
}"""
READ_PEER = """async ({ ahead }) => {
  const { gl, draw } = window.peer, { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
  for (let k = 0; k < 10; k++) {
    draw(ahead);
    await new Promise((done) => setTimeout(done, 100));
  }
  draw(ahead);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return { width, height, pixels: Array.from(pixels) };
}"""


def main() -> int:
    given = [word for word in sys.argv[1:] if word != "--gpu"]
    if not given or not (PEERS / "node_modules").is_dir() or chromium_path() is None:
        print("page_peers: needs the folder of a bundle, Chromium, and `npm ci` in its peers/; nothing measured")
        return 0
    folder, others = Path(given[0]), tuple(given[1:]) or OTHERS
    if unknown := set(others) - set(OTHERS):
        print(f"page_peers: no renderer {', '.join(sorted(unknown))}; choose from {', '.join(OTHERS)}")
        return 1
    bundle = store.read_bundle(folder)
    for budget in BUDGETS:
        compare(bundle, folder, budget, others)
    return 0


def compare(bundle: store.Bundle, folder: Path, budget: int, names: tuple[str, ...]) -> None:
    """Print and record the milliseconds of each renderer, and how near its picture is to the library's."""
    from playwright.sync_api import sync_playwright

    terrain, floor = endless.terrain_from_bundle(bundle, {"kind": "flat"}), bundle.manifest.eye_floor
    camera = stills.shot_camera(SHOT, terrain, floor, WIDTH, HEIGHT)
    field = collect_view(visibility.coarsen_to_budget(terrain, camera, budget), camera, bundle.manifest)
    still = np.clip(render(field, replace(camera, translation=np.zeros(3))).colour, 0, 1)
    x, y = (v * terrain.side for v in SHOT.at)
    place = {"x": x, "y": y, "eye": SHOT.height * floor, "yaw": SHOT.yaw, "pitch": -SHOT.pitch}
    times: dict[str, list[float]] = {"page": [], **{name: [] for name in names}}
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as playwright:
        own, others = Path(temporary, "page"), Path(temporary, "peers")
        write_page(folder, VIEWER, own)
        others.mkdir()
        for file in PEERS.iterdir():
            (others / file.name).symlink_to(file)
        write_field(field, others / "splats.ply", plain=True)
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=GPU_FLAGS if GPU else FLAGS)
        with served(own) as page, serve_plainly(others) as elsewhere:
            if GPU:
                print(read_renderer(browser, elsewhere))
            for number in range(ROUNDS):
                print(f"round {number + 1} of {ROUNDS}", file=sys.stderr, flush=True)
                found = time_page(browser, page, place, budget)
                times["page"] += found["render"]
                for name in names:
                    times[name] += time_peer(browser, elsewhere, name, place)
            pictures = {name: compare_pictures(read_picture(browser, elsewhere, name, place), still) for name in names}
        browser.close()
    # of two levels that are cross-faded the page draws all, the others only those that have a weight
    print(f"{len(field):,} Gaussians by the others, {found['counts'][-1]:,} by the page, {WIDTH} x {HEIGHT}")
    medians = {name: statistics.median(values) for name, values in times.items()}
    for name, value in medians.items():
        quality = f", {pictures[name]:.1f} dB from the library's picture" if name in pictures else ""
        print(f"  {name}: {value:.3g} ms (median of {len(times[name])}){quality}")
    figure = f"page_over_best_peer_{budget // 1000}k" + ("_gpu" if GPU else "")
    if names == OTHERS:  # of some alone it is not the best that is compared with
        report_figures({figure: medians["page"] / min(medians[name] for name in names)}, {figure: 0.5})


def read_renderer(browser, address: str) -> str:
    """What draws, as WebGL names it."""
    tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
    tab.goto(f"{address}index.html")
    name = tab.evaluate(RENDERER)
    tab.close()
    return name


def time_page(browser, address: str, place: dict, budget: int) -> dict:
    """Milliseconds of frames by the page, and the Gaussians of the last one."""
    tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
    tab.goto(f"{address}?still={budget}#{place['x']},{place['y']},{place['eye']},{place['yaw']},{place['pitch']}")
    tab.evaluate("import('./main.js').then(({ ready }) => ready)")
    places = [place | {"yaw": place["yaw"] + turn} for turn in TURNS]
    tab.evaluate("budget => import('./main.js').then(({ viewer }) => viewer.settle(budget))", budget)
    found = tab.evaluate(VISIT, {"places": places, "before": WARM_UP, "budget": budget})
    tab.close()
    return found


def open_peer(browser, address: str, name: str, place: dict):
    """A tab in which another renderer has loaded and sorted the splats."""
    vertical = np.degrees(2 * np.arctan(np.tan(np.radians(FIELD / 2)) * HEIGHT / WIDTH))
    tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
    tab.goto(f"{address}index.html")
    asked = {"name": name, "fov": float(vertical), "width": WIDTH, "height": HEIGHT}
    tab.evaluate(PEER, asked | {"ahead": [look(place["yaw"] + turn, place["pitch"]) for turn in TURNS]})
    return tab


def time_peer(browser, address: str, name: str, place: dict) -> list[float]:
    """Milliseconds of frames by another renderer."""
    tab = open_peer(browser, address, name, place)
    ahead = [look(place["yaw"] + turn, place["pitch"]) for turn in TURNS]
    times = tab.evaluate(TIME_PEER, {"ahead": ahead, "before": WARM_UP})
    tab.close()
    return times


def read_picture(browser, address: str, name: str, place: dict) -> dict:
    """What another renderer shows of the view."""
    tab = open_peer(browser, address, name, place)
    seen = tab.evaluate(READ_PEER, {"ahead": look(place["yaw"], place["pitch"])})
    tab.close()
    return seen


def collect_view(terrain: endless.EndlessTerrain, camera, manifest):
    """The Gaussians of a view around the eye, as the page draws them."""
    cells, eye = visibility.visible_cells(terrain, camera), camera.centre
    things = group_by_cell(terrain, cells, eye)
    backdrop = Backdrop.for_eye(terrain, eye, manifest.sky, manifest.ground_colour)
    placed = (place_cell(terrain, cells[k : k + 1], eye, things.get(k)) for k in range(len(cells)))
    return concatenate_fields([backdrop.blend_far(field, slope) for field, slope in placed])


def look(yaw: float, pitch: float) -> list[float]:
    """Unit vector of a direction in degrees."""
    a, b = np.radians([yaw, pitch])
    return [float(np.cos(b) * np.cos(a)), float(np.cos(b) * np.sin(a)), float(np.sin(b))]


def compare_pictures(seen: dict, still: np.ndarray) -> float | None:
    """PSNR of a picture that was read from below upwards."""
    picture = np.array(seen["pixels"], np.uint8).reshape(seen["height"], seen["width"], 4)[::-1, :, :3]
    return mse_to_psnr(float(((picture / 255 - still) ** 2).mean()))


@contextmanager
def serve_plainly(folder: Path):
    """The address of a folder on loopback, without the page's policies: the others run code from blobs."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}/"
    server.shutdown()
    server.server_close()


if __name__ == "__main__":
    sys.exit(main())
