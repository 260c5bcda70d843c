"""Milliseconds of a frame on a walk at a fixed height over hills, rendered by the library and by the page.

Both go the same way, frame by frame, at several budgets of Gaussians, and fill the same columns; milliseconds hold for
the machine that the row names, and for what else it did meanwhile (`load`).
"""

import os
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from fixtures import browser

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import figures
from dav_gswt.logs import progress
from dav_gswt.terrain import endless, heights, splats, stills, visibility
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.placement import group_by_cell, place_cell
from dav_gswt.terrain.stills import Shot
from dav_gswt.threads import default_threads
from dav_gswt_study import csv_tables
from dav_gswt_study.machine import describe_machine
from dav_gswt_study.tables import spread
from dav_gswt_study.terrain.walk import walk_shots

PARTS = ("render", "sort", "update")
LIBRARY, PAGE = "library", "page"
MIN_MS = 0.1  # lower end of the axis
MIN_FACTOR, BISECTIONS = 1e-5, 16  # of the search for a factor on level distances
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


def time_library(bundle: Bundle, settings: FrameSettings) -> list[dict]:
    """A row for each budget, of the library on all processors: every frame is updated, sorted and rendered.

    update holds the orders, too, which the library makes again for every frame; the page reads them from the bundle.
    """
    terrain, manifest, rows = endless.terrain_from_bundle(bundle, settings.heights), bundle.manifest, []
    for budget in progress(settings.budgets, "measure frames of the library"):
        frames = []
        for shot in settings.shots():
            camera = stills.shot_camera(shot, terrain, manifest.eye_floor, settings.width, settings.height)
            frames.append(time_frame(terrain, camera, manifest, budget))
        times = {part: [milliseconds[part] for milliseconds, _ in frames] for part in PARTS}
        counts = [count for _, count in frames]
        rows.append(_tabulate_times(settings, budget, times, counts, len(frames)) | _describe_renderer(LIBRARY, ""))
    return rows


def time_frame(
    terrain: EndlessTerrain, camera: Camera, manifest: Manifest, budget: int
) -> tuple[dict[str, float], int]:
    """Milliseconds of a frame by part, and its Gaussians. What is done is what `stills.render_view` does."""
    eye, here, milliseconds = camera.centre, replace(camera, translation=np.zeros(3)), dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def measure(part: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        milliseconds[part] += 1e3 * (time.perf_counter() - start)

    with ThreadPoolExecutor(default_threads()) as pool:
        with measure("update"):
            shown = coarsen_to_budget(terrain, camera, budget)
            cells = visibility.visible_cells(shown, camera)
            things, numbers = group_by_cell(shown, cells, eye), range(len(cells))
            placed = list(pool.map(lambda k: place_cell(shown, cells[k : k + 1], eye, things.get(k)), numbers))
        with measure("render"):
            backdrop = Backdrop.for_eye(shown, eye, manifest.sky, manifest.ground_colour)
            parts = list(
                pool.map(lambda each: splats.project(backdrop.blend_far(each[0]), each[1], here, shown.near)[0], placed)
            )
    with measure("sort"):
        far, close = ([part for k, part in enumerate(parts) if cells.close[k] == near] for near in (False, True))
        last = splats.Splats.concatenate([splats.EMPTY, *close])
        ordered = splats.Splats.concatenate([*far, last[splats.depth_order(last)]])
    with measure("render"):
        seen = splats.blend(ordered, here)
        np.clip(seen.colour + (1 - seen.alpha)[..., None] * backdrop.colours_along(here.rays()[1]), 0, 1)
    return milliseconds, sum(len(field) for field, _ in placed)


def coarsen_to_budget(terrain: EndlessTerrain, camera: Camera, budget: int) -> EndlessTerrain:
    """Multiply all level distances by one factor, the largest with which a picture has at most `budget` Gaussians.

    The viewer does the same and also moves the end of the ground nearer. Where the coarsest level alone exceeds the
    budget, that level is used.
    """
    cells, low, high = visibility.visible_cells(terrain, camera), MIN_FACTOR, 1.0

    def scale_distances(factor: float) -> EndlessTerrain:
        return replace(
            terrain, switches=[factor * s for s in terrain.switches], bands=[factor * b for b in terrain.bands]
        )

    if visibility.count_gaussians(terrain, cells).sum() <= budget:
        return terrain
    for _ in range(BISECTIONS):
        middle = float(np.sqrt(low * high))
        fits = visibility.count_gaussians(scale_distances(middle), cells).sum() <= budget
        low, high = (middle, high) if fits else (low, middle)
    return scale_distances(low)


def time_page(bundle_dir: Path | str, viewer_dir: Path | str, manifest: dict, settings: FrameSettings) -> list[dict]:
    """A row for each budget, of the page in a headless Chromium with software rendering.

    render: until the first pixel can be read; sort and update: in the worker, meanwhile. Their shares are of frames
    that something new had come for from the worker.
    Raises: InputError: see `browser.chromium`, `page.write_page`.
    """
    surface, rows = heights.surface_from_config(settings.heights, manifest["tile_side"]), []
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
                times = {part: found[part] for part in PARTS}
                rows.append(
                    _tabulate_times(settings, budget, times, found["counts"], found["ran"])
                    | _describe_renderer(PAGE, found["gl"])
                )
    return rows


def _shot_to_place(shot: Shot, manifest: dict) -> dict:
    """A shot as a place of the page."""
    x, y = (v * manifest["tile_side"] for v in shot.at)
    return {"x": x, "y": y, "eye": shot.height * manifest["eye_floor"], "yaw": shot.yaw, "pitch": -shot.pitch}


def _tabulate_times(
    settings: FrameSettings, budget: int, times: dict[str, list[float]], counts: list[int], ran: int
) -> dict:
    """Means and standard deviations (ddof 1); None for what the worker never did."""
    frames = len(counts)
    row: dict[str, float | None] = {"width": settings.width, "height": settings.height, "frames": frames}
    row |= {"budget": budget, "splats": float(np.mean(counts))}
    for part in PARTS:
        values = times[part]
        row[f"{part}_ms"] = float(np.mean(values)) if values else None
        row[f"{part}_ms_sd"] = float(np.std(values, ddof=1)) if len(values) > 1 else None
        if part != "render":
            row[f"{part}_share"] = ran / frames
    return row


def _describe_renderer(renderer: str, gl: str) -> dict:
    return {"renderer": renderer, "gl": gl} | describe_machine() | {"load": os.getloadavg()[0]}


def gather_frames(cells: list[dict], library: list[str], page: list[str]) -> list[dict]:
    """All rows, with the columns of each experiment first. library, page: a table for each experiment."""
    found = []
    for cell, *paths in zip(cells, library, page, strict=True):
        found += [cell | row for path in paths for row in csv_tables.read_table(path)]
    return found


def select_viewer_rows(rows: list[dict]) -> list[dict]:
    """The page's row of each bundle at the first budget, with the columns that the study's tables join."""
    first: dict[tuple, dict] = {}
    for row in rows:
        if row["renderer"] == PAGE:
            first.setdefault(tuple(row[key] for key in spread.CELL), row)
    return [{key: row[key] for key in (*spread.CELL, *spread.VIEWER)} for row in first.values()]


def plot_frames(rows: list[dict]):
    """Milliseconds of a frame's parts over Gaussians in view, a panel for each renderer; rows hold text."""
    from matplotlib.ticker import LogLocator  # here, not above: see `figures.make_figure`

    figure = figures.make_figure(10.0, 4.4)
    panels = figure.subplots(1, 2)
    for axes, renderer in zip(panels, (LIBRARY, PAGE), strict=True):
        mine = [row for row in rows if row["renderer"] == renderer]
        for k, scene in enumerate(dict.fromkeys(row["scene"] for row in mine)):
            of_scene = sorted((r for r in mine if r["scene"] == scene), key=lambda row: float(row["splats"]))
            for part, style in zip(PARTS, ("-o", "--s", ":^"), strict=True):
                known = [row for row in of_scene if row[f"{part}_ms"]]
                x, y, sd = ([float(r[key] or 0) for r in known] for key in ("splats", f"{part}_ms", f"{part}_ms_sd"))
                axes.errorbar(
                    x, y, yerr=sd, fmt=style, color=f"C{k}", markersize=4, capsize=2, label=f"{scene}: {part}"
                )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(bottom=MIN_MS)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:g} k")
        axes.xaxis.set_minor_formatter("")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.set_title(_format_title(renderer, mine), fontsize=9, loc="left")
        axes.set_xlabel("Gaussians in view")
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("milliseconds a frame (mean, sd)")
    named = next((axes for axes in panels if axes.get_legend_handles_labels()[0]), panels[0])
    figure.legend(*named.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def _format_title(renderer: str, rows: list[dict]) -> str:
    if not rows:
        return f"{renderer}: not measured"
    row = rows[0]
    software = " in Chromium, software rendering" if "SwiftShader" in row["gl"] else ""
    return f"{renderer}{software}, {row['width']} x {row['height']}\n{row['processor']}, {row['cores']} cores"
