"""Milliseconds of a frame of the page on a walk at a fixed height over hills, at several budgets of Gaussians.

Milliseconds hold for the machine that the row names, and for what else it did meanwhile (`load`).
"""

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fixtures import browser

from dav_gswt.images import figures
from dav_gswt.logs import progress
from dav_gswt.terrain import heights
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.stills import Shot
from dav_gswt_study.machine import describe_machine
from dav_gswt_study.tables import spread
from dav_gswt_study.terrain.walk import walk_shots

PARTS = ("render", "sort", "update")
MIN_MS = 0.1  # lower end of the axis
WARM_UP = 4  # uncounted frames at the start, in which orders are made and shaders compiled
VISIT = """async ({ places, before, budget }) => {
  const { viewer } = await import("./main.js");
  const gl = document.getElementById("picture").getContext("webgl2"), pixel = new Uint8Array(4);
  const render = [], counts = [], times = { update: [], sort: [] };
  let last = null, ran = 0;
  for (let k = -before; k < places.length; k++) {
    viewer.setPlace(places[Math.max(k, 0)]);
    if (viewer.scene.client.idle) viewer.askWorker(budget, false);
    await new Promise((done) => requestAnimationFrame(done));
    const start = performance.now();
    viewer.drawFrame();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    const answer = viewer.scene.frame;
    if (k >= 0) {
      render.push(performance.now() - start);
      counts.push(answer.count);
      if (answer !== last) for (const part in times) times[part].push(answer.milliseconds[part]);
      ran += answer !== last;
    }
    last = answer;
  }
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  return { render, ...times, counts, ran, gl: gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER) };
}"""


@dataclass(frozen=True)
class FrameSettings:
    """The config's `frames`: surface, walk, size of a frame, budgets of Gaussians."""

    heights: dict
    flight: dict
    width: int
    height: int
    budgets: list[int]

    def shots(self) -> list[Shot]:
        return walk_shots(**self.flight)


def time_page(bundle_dir: Path | str, viewer_dir: Path | str, manifest: dict, settings: FrameSettings) -> list[dict]:
    """A row for each budget, of the page in a headless Chromium with software rendering.

    render: until the first pixel can be read; sort and update: in the worker, meanwhile. Their shares are of frames
    that something new had come for from the worker.
    Raises: InputError: see `browser.chromium`, `page.write_page`.
    """
    surface, rows = heights.surface_from_config(settings.heights, manifest["tile_side"], manifest["eye_floor"]), []
    places = [_shot_to_place(shot, manifest) for shot in settings.shots()]
    first = ",".join(f"{places[0][key]:.6g}" for key in ("x", "y", "eye", "yaw", "pitch"))
    with tempfile.TemporaryDirectory() as folder, browser.chromium() as chromium:
        write_page(bundle_dir, viewer_dir, Path(folder) / "page", surface)
        with browser.served(Path(folder) / "page") as address:
            tab = chromium.new_page(viewport={"width": settings.width, "height": settings.height})
            tab.goto(f"{address}?still={min(settings.budgets)}#{first}")
            tab.evaluate("import('./main.js').then(({ ready }) => ready)")
            for budget in progress(settings.budgets, "measure frames of the page"):
                found = tab.evaluate(VISIT, {"places": places, "before": WARM_UP, "budget": budget})
                row = _tabulate_times(settings, budget, found)
                rows.append(row | {"gl": found["gl"]} | describe_machine() | {"load": os.getloadavg()[0]})
    return rows


def _shot_to_place(shot: Shot, manifest: dict) -> dict:
    """A shot as a place of the page."""
    x, y = (v * manifest["tile_side"] for v in shot.at)
    return {"x": x, "y": y, "eye": shot.height * manifest["eye_floor"], "yaw": shot.yaw, "pitch": -shot.pitch}


def _tabulate_times(settings: FrameSettings, budget: int, found: dict) -> dict:
    """Means and standard deviations (ddof 1); None for what the worker never did. found: what VISIT returns."""
    frames = len(found["counts"])
    row: dict[str, float | None] = {"width": settings.width, "height": settings.height, "frames": frames}
    row |= {"budget": budget, "splats": float(np.mean(found["counts"]))}
    for part in PARTS:
        values = found[part]
        row[f"{part}_ms"] = float(np.mean(values)) if values else None
        row[f"{part}_ms_sd"] = float(np.std(values, ddof=1)) if len(values) > 1 else None
        if part != "render":
            row[f"{part}_share"] = found["ran"] / frames
    return row


def select_viewer_rows(rows: list[dict]) -> list[dict]:
    """The row of each bundle at the first budget, with the columns that the study's tables join."""
    first: dict[tuple, dict] = {}
    for row in rows:
        first.setdefault(tuple(row[key] for key in spread.CELL), row)
    return [{key: row[key] for key in (*spread.CELL, *spread.VIEWER)} for row in first.values()]


def plot_frames(rows: list[dict]):
    """Milliseconds of a frame's parts over Gaussians in view; rows hold text."""
    from matplotlib.ticker import LogLocator  # here, not above: see `figures.make_figure`

    figure = figures.make_figure(6.4, 4.4)
    axes = figure.subplots()
    for k, scene in enumerate(dict.fromkeys(row["scene"] for row in rows)):
        of_scene = sorted((r for r in rows if r["scene"] == scene), key=lambda row: float(row["splats"]))
        for part, style in zip(PARTS, ("-o", "--s", ":^"), strict=True):
            known = [row for row in of_scene if row[f"{part}_ms"]]
            x, y, sd = ([float(r[key] or 0) for r in known] for key in ("splats", f"{part}_ms", f"{part}_ms_sd"))
            label = f"{scene}: {part}"
            axes.errorbar(x, y, yerr=sd, fmt=style, color=f"C{k}", markersize=4, capsize=2, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=MIN_MS)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:g} k")
    axes.xaxis.set_minor_formatter("")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    software = " in Chromium, software rendering" if "SwiftShader" in rows[0]["gl"] else ""
    about = f"{rows[0]['width']} x {rows[0]['height']}\n{rows[0]['processor']}, {rows[0]['cores']} cores"
    axes.set_title(f"the page{software}, {about}", fontsize=9, loc="left")
    axes.set_xlabel("Gaussians in view")
    axes.set_ylabel("milliseconds a frame (mean, sd)")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure
