"""Sweeps: one table of what the cells of a row of the config's `sweeps` measured, and one figure.

The figure has a panel a measure over what is varied; where rounds are too, PSNR against photos as well.
"""

from pathlib import Path

import numpy as np

from dav_gswt.files import read_json
from dav_gswt.images import figures
from dav_gswt.sweeps import CELL, COLUMNS, ORDERS, QUALITY, TILES, TIMES, describe_origin, tabulate_cell
from dav_gswt_study import csv_tables, plots
from dav_gswt_study.experiments import EVERYTHING
from dav_gswt_study.figures import OKABE_ITO
from dav_gswt_study.seams import summary

KEY = ("sweep", *CELL)  # what tells rows apart
ABOUT = ("samples", "steps")  # of the prior, which its name hides
SEAMS = ("seam_lpips", "seam_lpips_low", "seam_lpips_high", "seam_psnr", "seam_jump", "seam_density")
NUMBERS = (*ABOUT, "photos", "gaussians", *QUALITY, *TILES, *ORDERS, *SEAMS, *TIMES)
PANELS = {
    "psnr": "PSNR of test views (dB)",
    "worst_psnr": "PSNR, worst tenth (dB)",
    "lpips": "LPIPS of test views",
    "seam_lpips": "Seam-LPIPS over its floor",
    "seam_density": "cuts through strong gradients",
    "uncertainty": "mean uncertainty of tiles",
    "orders": "orders of all tiles",
    "bundle_mb": "bundle (MB)",
    "score_s": "scoring a round (s)",
    "recon_s": "reconstruction (s)",
    "cut_s": "cutting tiles (s)",
    "stills_s": "three stills (s)",
    "peak_mb": "peak memory (MB)",
}
PANELS_A_ROW, WIDE, TALL = 3, 3.3, 2.5  # inches a panel
LONG = 8  # letters of a name, above which names lie askew


def tabulate_experiment(cell: dict) -> dict:
    """The row of an experiment: the columns of `dav_gswt.sweeps.tabulate_experiment`, what was varied, and its seams.

    seam_lpips: Seam-LPIPS of cuts less their floor over all views, with its 95 % interval over places; seam_psnr and
    seam_jump of these cuts; seam_density: share of their length through strong gradients.
    cell: what KEY and ABOUT name, `varied`, `corrected`, `files` of what was measured, `times`: benchmarks by job.
    """
    found = {key: cell[key] for key in (*KEY, *ABOUT)}
    found |= {f"varied_{k}": value for k, value in enumerate(cell["varied"].values())}
    found |= dict.fromkeys(SEAMS) | {"tiles": None} | tabulate_cell(cell)
    found |= _read_seams(cell | cell["files"]) if "crops" in cell["files"] else {}
    return {name: found[name] for name in list_columns(len(cell["varied"]))}


def list_columns(axes: int) -> tuple[str, ...]:
    """The table's columns, in order. axes: how many settings are varied together."""
    return (*KEY, *(f"varied_{k}" for k in range(axes)), *ABOUT, *COLUMNS, *SEAMS, "tiles")


def read_sweep(path: Path | str) -> list[dict]:
    """Read a sweep's table, NUMBERS as floats, None where empty; no rows where there is no file yet."""
    return csv_tables.read_table(path, numbers=NUMBERS, missing_ok=True)


def _read_seams(cell: dict) -> dict:
    rows = summary.tabulate_crops(cell | {"table": cell["crops"], "variant": cell["tiling"], "replicate": 0})
    row = next(r for r in summary.summarise_crops(rows) if r["view"] == r["ground"] == summary.EVERY)
    named = {"seam_lpips": "cut", "seam_lpips_low": "cut_low", "seam_lpips_high": "cut_high"}
    found = {key: row[name] for key, name in (named | {"seam_psnr": "cut_psnr", "seam_jump": "cut_jump"}).items()}
    facts = read_json(cell["facts"])
    return found | {"seam_density": facts["dense"], "tiles": row["tiles"]} | describe_origin(facts["provenance"])


def draw_figure(name: str, axes: list[str], rows: list[dict]):
    """Draw one line per scene through the means over seeds, and one dot per seed.

    name: of the sweep. axes: the settings that are varied, as the config names them. With two axes the figure shows the
    last value of the second one; curves of PSNR against photos have one line for each value of the first.
    """
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    curves = scenes if "rounds" in axes[1:] else []
    last = [row for row in rows if len(axes) < 2 or row["varied_1"] == _last(rows, row["varied_0"])]
    shown = [key for key in PANELS if any(row[key] is not None for row in last)]
    count = len(curves) + len(shown)
    figure = figures.make_figure(WIDE * min(PANELS_A_ROW, count), TALL * -(-count // PANELS_A_ROW) + 0.5)
    grid = figure.subplots(-(-count // PANELS_A_ROW), min(PANELS_A_ROW, count), squeeze=False).ravel()
    for panel, scene in zip(grid, curves, strict=False):
        _draw_curves(panel, [row for row in rows if row["scene"] == scene])
        panel.set_title(scene, fontsize=9, loc="left")
    for panel, key in zip(grid[len(curves) :], shown, strict=False):
        _draw_panel(panel, axes[0], key, last, scenes)
    for empty in grid[count:]:
        empty.axis("off")
    key = grid[len(curves)].get_legend_handles_labels()
    figure.legend(*key, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.suptitle(f"sweep {name}", fontsize=10)
    if curves:
        grid[0].legend(frameon=False, fontsize=7)
    return figure


def _last(rows: list[dict], value: str) -> str:
    """The last value of the second axis that the first one's value comes with."""
    return [row["varied_1"] for row in rows if row["varied_0"] == value][-1]


def _draw_panel(panel, axis: str, key: str, rows: list[dict], scenes: list[str]) -> None:
    values = list(dict.fromkeys(row["varied_0"] for row in rows))
    for scene, colour in zip(scenes, OKABE_ITO * len(scenes), strict=False):
        found = {v: [r[key] for r in rows if (r["scene"], r["varied_0"]) == (scene, v)] for v in values}
        known = {v: [x for x in each if x is not None] for v, each in found.items()}
        at = [i for i, v in enumerate(values) if known[v]]
        means = [float(np.mean(known[values[i]])) for i in at]
        line = 1.2 if all(map(_is_number, values)) else 0  # between names there is nothing
        panel.plot(at, means, marker="_", markersize=14, markeredgewidth=2, color=colour, linewidth=line, label=scene)
        for i in at:
            panel.plot([i] * len(known[values[i]]), known[values[i]], "o", color=colour, markersize=3.5, alpha=0.6)
    askew = {"rotation": 30, "ha": "right"} if max(map(len, values)) > LONG else {}
    panel.set_xticks(range(len(values)), values, fontsize=8, **askew)
    panel.set_xlim(-0.5, len(values) - 0.5)
    panel.set_xlabel(axis, fontsize=9)
    panel.set_ylabel(PANELS[key], fontsize=9)
    panel.tick_params(labelsize=8)
    panel.grid(alpha=0.3)


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdigit()


def _draw_curves(panel, rows: list[dict]) -> None:
    values = [value for value in dict.fromkeys(row["varied_0"] for row in rows) if value != EVERYTHING]
    for value, colour in zip(values, OKABE_ITO * len(values), strict=False):
        plots.draw_curve(panel, [row for row in rows if row["varied_0"] == value], value, color=colour, linewidth=1.4)
    everything = [row for row in rows if row["varied_0"] == EVERYTHING and row["psnr"] is not None]
    plots.draw_everything(panel, [row for row in everything if row["photos"] == everything[-1]["photos"]])
    plots.label_curves(panel)
