"""The page beside Spark and SuperSplat's viewer: bytes, and seconds to the first and the full picture, of one ground.

`PYTHONPATH=study:tests:benchmarks python study/benchmarks/compare_pages.py BUNDLE PEERS` with a folder in which you
called `npm install three@0.187.0 @sparkjsdev/spark@2.2.0 @playcanvas/supersplat-viewer@1.36.2 esbuild@0.25.12`. Writes
data/comparison_pages.csv of study/docs, and the served folders to PEERS/site.

The others get CELLS x CELLS cells of the terrain at the finest level, as SPZ and SOG. The eye stands at the same place
and looks the same way. One server compresses the text files of all three and slows the line down, workers included. In
headless Chromium with software rendering, a new browser each time; medians of VISITS.
"""

import gzip
import json
import os
import shutil
import statistics
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from functools import cache, partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
from first_view import LIVE, WATCH
from fixtures.browser import chromium
from fixtures.page_visit import VIEWER

from dav_gswt.bundle import store
from dav_gswt.files import read_json, write_json, write_table
from dav_gswt.images import image_files
from dav_gswt.terrain import endless, page, stills

CELLS, VISITS = 4, 3
SIZE = {"width": 640, "height": 360}
LINES = {"loopback": (0.0, float("inf")), "20 Mbit/s, 40 ms": (0.04, 20e6 / 8)}  # seconds a request, bytes a second
TEXT = {".html", ".js", ".css", ".json"}
DATA = {".bin", ".spz", ".sog", ".jpg"}
SHOT = stills.SHOTS[0]  # where everybody begins
SPARK = """
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import { PerspectiveCamera, Scene, WebGLRenderer } from "three";
const renderer = new WebGLRenderer({ antialias: false }), gl = renderer.getContext(), pixel = new Uint8Array(4);
const { position, target, fov } = POSE;
const camera = new PerspectiveCamera(fov, innerWidth / innerHeight, 0.001, 1e4), scene = new Scene();
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
camera.position.set(...position);
camera.lookAt(...target);
const splats = new SplatMesh({ url: "terrain.spz" });
splats.initialized.then(() => window.loaded = performance.now() / 1000);
scene.add(new SparkRenderer({ renderer }), splats);
renderer.setAnimationLoop(() => {
  renderer.render(scene, camera);
  gl.readPixels(innerWidth / 2, innerHeight / 4, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  if (pixel[0]) window.firstFrame?.(); // ground instead of black
});
"""
SPARK_PAGE = "<!DOCTYPE html><style>body { margin: 0 }</style><body><script type=module src=main.js></script>"
EFFECTS = ("sharpness", "bloom", "grading", "vignette", "fringing")
# a pixel that is read waits for the graphics processor
FINISH = """
  window.finish = () => {
    const gl = document.querySelector("canvas").getContext("webgl2");
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now() / 1000;
  };
  window.shown = new Promise((done) => window.firstFrame = () => done(finish()));
"""
WHOLE = """async () => {
  const { viewer } = await import("./main.js");
  while (!viewer.resting.whole) await new Promise((done) => setTimeout(done, 50));
  return [finish(), viewer.scene.frame.count];
}"""
PROGRAMS = {
    "DAV-GSWT": "page/",
    "Spark": "spark/",
    "SuperSplat viewer": "supersplat/?webgl&noui&noanim&content=terrain.sog",
}


def main() -> None:
    bundle, peers = map(Path, sys.argv[1:])
    site = peers / "site"
    write_site(bundle, peers, site)
    rows = []
    for line, (latency, rate) in LINES.items():
        with serve_site(site, latency, rate) as (address, sent):
            for visit in range(VISITS):  # in turn, so that other jobs disturb all alike
                for program in PROGRAMS:
                    row = {"line": line, "program": program, "visit": visit}
                    rows.append(row | visit_page(program, address, sent) | {"load": round(os.getloadavg()[0], 1)})
                    print(rows[-1], flush=True)
    write_table(Path(__file__).resolve().parents[1] / "docs/data/comparison_pages.csv", rows)
    for line, program in ((line, program) for line in LINES for program in PROGRAMS):
        own = [row for row in rows if (row["line"], row["program"]) == (line, program)]
        print(line, program, {name: statistics.median(row[name] for row in own) for name in ("drawn", "full")})


@cache
def compress(text: bytes) -> bytes:
    """A text file as servers send it, packed once."""
    return gzip.compress(text)


def write_site(bundle: Path, peers: Path, site: Path) -> None:
    """The folders that are served: page, spark, supersplat; what is there stays."""
    if site.exists():
        return
    made = store.read_bundle(bundle)
    terrain = endless.terrain_from_bundle(made, {"kind": "flat"})
    image_files.write_png(peers / "still.png", np.clip(stills.render_shot(terrain, SHOT, made.manifest, **SIZE), 0, 1))
    page.write_page(bundle, VIEWER, site / "page", front=page.front_of_scene("comparison", None, peers / "still.png"))
    middle = str(CELLS / 2)
    asked = ["--columns", str(CELLS), "--rows", str(CELLS), "--centre", middle, middle, "--formats", "spz", "sog"]
    program = str(Path(sys.executable).with_name("dav-gswt"))
    subprocess.run([program, "export", str(bundle), *asked, "-o", str(peers)], check=True)
    shutil.copytree(peers / "node_modules/@playcanvas/supersplat-viewer/public", site / "supersplat")
    shutil.move(peers / "terrain/terrain.sog", site / "supersplat")
    (site / "spark").mkdir()
    shutil.move(peers / "terrain/terrain.spz", site / "spark")
    camera = stills.shot_camera(SHOT, terrain, made.manifest.eye_floor, **SIZE)
    y_up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    eye = y_up @ (camera.centre - read_json(peers / "terrain/terrain.json")["origin"])
    target = eye + y_up @ camera.rotation[2]
    across, down = (float(2 * np.degrees(np.arctan(SIZE[side] / 2 / camera.fx))) for side in ("width", "height"))
    pose = {"position": eye.tolist(), "target": target.tolist(), "fov": down}
    turn = np.array([-1, 1, -1])  # SuperSplat turns its files about z, where our SPZ is turned about x
    turned = {"position": (turn * eye).tolist(), "target": (turn * target).tolist(), "fov": across}
    (peers / "spark.js").write_text(SPARK.replace("POSE", json.dumps(pose)))
    bundled = ["--bundle", "--minify", "--format=esm", f"--outfile={site / 'spark/main.js'}"]
    subprocess.run([peers / "node_modules/.bin/esbuild", peers / "spark.js", *bundled], check=True)
    (site / "spark/index.html").write_text(SPARK_PAGE)
    write_json(site / "supersplat/settings.json", {"version": 2, "tonemapping": "none", "highPrecisionRendering": False,
        "background": {"color": [0, 0, 0]}, "postEffectSettings": {name: {"enabled": False} for name in EFFECTS},
        "animTracks": [], "cameras": [{"initial": turned}], "annotations": [], "startMode": "default"})  # fmt: skip


def visit_page(program: str, address: str, sent: dict) -> dict:
    """Bytes and seconds of one visit.

    still: our still picture is shown. loaded: Spark has decoded its file. drawn: all of the view is drawn, by our page
    with a share of the Gaussians. full: with all of them.
    """
    with chromium() as browser:
        tab = browser.new_page(viewport=SIZE)
        tab.add_init_script(WATCH + FINISH)
        sent.clear()
        tab.goto(address + PROGRAMS[program], wait_until="commit")
        if program == "DAV-GSWT":
            drawn, (full, count) = tab.evaluate(LIVE)[1], tab.evaluate(WHOLE)
            print(f"{count} Gaussians")
        else:
            drawn = full = tab.evaluate("shown")
        still, loaded = tab.evaluate("[seen.sharp || null, window.loaded ?? null]")
    data = sum(size for name, size in sent.items() if Path(name).suffix in DATA)
    seconds = {"still": still, "loaded": loaded, "drawn": drawn, "full": full}
    return {"data": data, "code": sum(sent.values()) - data} | seconds


@contextmanager
def serve_site(site: Path, latency: float, rate: float):
    """The address of a folder behind a line, and the bytes that were sent of each file."""
    sent: dict[str, int] = {}
    lock, free = threading.Lock(), [0.0]

    class Handler(SimpleHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self):
            path = Path(self.translate_path(self.path))
            path = path / "index.html" if path.is_dir() else path
            time.sleep(latency)
            if not path.is_file():
                self.send_error(404)
                return
            body = path.read_bytes()
            self.send_response(200)
            self.send_header("Content-Type", self.guess_type(path))
            if path.suffix in TEXT:
                body = compress(body)
                self.send_header("Content-Encoding", "gzip")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            for k in range(0, len(body), 1 << 14):
                part = body[k : k + (1 << 14)]
                with lock:  # all connections share the line
                    sent[str(path)] = sent.get(str(path), 0) + len(part)
                    free[0] = max(time.perf_counter(), free[0]) + len(part) / rate
                    until = free[0]
                time.sleep(max(0.0, until - time.perf_counter()))
                self.wfile.write(part)

        def log_message(self, format, *arguments):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(site)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}/", sent
    server.shutdown()
    server.server_close()


if __name__ == "__main__":
    main()
