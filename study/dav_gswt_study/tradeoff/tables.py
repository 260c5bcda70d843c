"""The table of the trade-off: a row for each setting with its cost, quality, and loss to the most accurate setting."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.images import image_files
from dav_gswt.images.metrics import mse_to_psnr
from dav_gswt.sweeps import CELL, sum_or_none
from dav_gswt_study import csv_tables, sweeps
from dav_gswt_study.machine import describe_machine
from dav_gswt_study.statistics import subtract_or_none

KEY = ("scene", "seed", "knob", "setting", "preset", "tiling", "prior", "tau", "processor", "cores")  # tells rows apart
TILE_JOBS = ("levels_s", "cut_s", "bundle_s")
LEVELS_OF_GREY = 255
UNITS = {"views": "dB", "stills": "grey levels", "seams": "LPIPS"}  # of losses
TEXTS = ("scene", "knob", "setting", "measure", "preset", "policy", "prior", "tiling", "psnr_is", "version", "renderer")
TEXTS += ("fixed_quality", "field", "tiles", "processor", "part", "chosen", "rival_knob", "rival_setting")


def tabulate_settings(cells: list[dict]) -> list[dict]:
    """A row for each experiment; the most accurate setting of a knob comes first, and the others are compared with it.

    seconds: of all jobs from the start views to the bundle, but the taking of photos; what cells share counts for each.
    own_seconds: of those that the knob can change: all of them where views tell its accuracy, else the jobs on tiles.
    loss: of PSNR in dB (views), of Seam-LPIPS over its floor (seams), or the root mean square difference of the stills
    in grey levels (stills); 0 for what is taken for the most accurate, below 0 where a setting is better than it.
    stills_psnr: empty where equal. cells: what `tabulate_experiment` reads, with `knob`, `setting`, `most`,
    `base`, `measure` and the paths of `stills`.
    """
    found, best = [], {}
    for cell in cells:
        row = measure_cell(cell)
        if cell["most"]:
            best[cell["knob"]] = cell | row
        about = {key: cell[key] for key in ("knob", "setting", "measure")}
        about |= {key: int(cell[key]) for key in ("most", "base")}
        found.append(about | row | _lost(cell | row, best[cell["knob"]]) | describe_machine())
    return found


def measure_cell(cell: dict) -> dict:
    """Measures and cost of an experiment: the columns of a sweep's row, seconds and own_seconds."""
    row = {
        key: value
        for key, value in sweeps.tabulate_experiment(cell).items()
        if key not in ("sweep", "samples", "steps")
    }
    tiles = sum_or_none(row[key] for key in TILE_JOBS)
    seconds = sum_or_none([row["recon_s"], tiles])
    return row | {"seconds": seconds, "own_seconds": seconds if cell.get("measure") == "views" else tiles}


def _lost(mine: dict, best: dict) -> dict:
    found = {"loss_lpips": subtract_or_none(mine["lpips"], best["lpips"]), "stills_psnr": None}
    if mine["measure"] == "stills":
        error = mean_square(mine["stills"], best["stills"])
        found["stills_psnr"] = mse_to_psnr(error)
        return found | {"loss": LEVELS_OF_GREY * float(np.sqrt(error))}
    if mine["measure"] == "seams":
        return found | {"loss": subtract_or_none(mine["seam_lpips"], best["seam_lpips"])}
    return found | {"loss": subtract_or_none(best["psnr"], mine["psnr"])}


def mean_square(mine: list[str], others: list[str]) -> float:
    """Mean squared difference of pictures, pair by pair, over all their pixels; 0 where they are equal."""
    found = [
        (image_files.read_photo(a).astype(float) - image_files.read_photo(b)) ** 2
        for a, b in zip(mine, others, strict=True)
    ]
    return float(np.mean([difference.mean() for difference in found]))


def tabulate_front(table: list[dict]) -> list[dict]:
    """The rows that test views tell apart: `front`, 1 where nothing is as fast and better (or as good and faster);
    else by how many dB (`behind`) the best that is as fast (`rival_knob`, `rival_setting`) is better. `sharp`: 1 where
    nothing is as fast with a lower LPIPS; empty where LPIPS was not measured of all."""
    cells = {}
    for row in table:
        cells.setdefault(tuple(row[key] for key in CELL), row)  # knobs share the base: it is one point
    views = [row for row in cells.values() if row["measure"] == "views"]
    known = [row for row in views if None not in (row["seconds"], row["psnr"])]
    if not known:
        return []
    cost, worth = (np.array([row[key] for row in known], float) for key in ("seconds", "psnr"))
    blurred = [row["lpips"] for row in known]
    sharp = (
        [None] * len(known)
        if None in blurred
        else find_pareto_front(cost, -np.array(blurred, float)).astype(int).tolist()
    )
    shown = ("scene", "seed", "knob", "setting", "base", "seconds", "psnr", "ssim", "lpips", "peak_mb", "bundle_mb")
    return [
        {key: row[key] for key in shown}
        | {"front": int(on), "behind": float(worth[rival] - worth[i]), "sharp": sharp[i]}
        | {f"rival_{key}": known[rival][key] if rival != i else "" for key in ("knob", "setting")}
        for i, (row, on, rival) in enumerate(
            zip(known, find_pareto_front(cost, worth), find_rivals(cost, worth), strict=True)
        )
    ]


def find_pareto_front(cost: Float[Array, " n"], worth: Float[Array, " n"]) -> Bool[Array, " n"]:
    """Points that no other point dominates (costs no more and is worth no less, one of the two strictly).

    Equal points are on the front together. One pass by rising cost, for O(n log n).
    """
    on, best = np.zeros(len(cost), bool), -np.inf
    for price in np.unique(cost):
        at = cost == price
        top = worth[at].max()
        if top > best:
            on[at], best = worth[at] == top, top
    return on


def find_rivals(cost: Float[Array, " n"], worth: Float[Array, " n"]) -> Int[Array, " n"]:
    """For each point the one worth most among those that cost no more; itself where none is worth more.

    How far it lies behind the front is worth[rival] - worth, from 0.
    """
    found = np.arange(len(cost))
    for i in found:
        affordable = np.where(cost <= cost[i], worth, -np.inf)
        if affordable.max() > worth[i]:
            found[i] = int(affordable.argmax())
    return found


def read_tradeoff(path: Path | str) -> list[dict]:
    """Read a table of the trade-off: numbers as floats, None where empty; TEXTS as text."""
    return csv_tables.read_table(path, texts=TEXTS)
