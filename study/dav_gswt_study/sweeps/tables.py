"""The table of a comparison: a row for each experiment with its settings, measures, costs and provenance."""

from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.files import read_json
from dav_gswt.sweeps import COLUMNS, QUALITY, TILES, TIMES, describe_origin, tabulate_cell
from dav_gswt_study.seams import summary
from dav_gswt_study.seams import tables as crops
from dav_gswt_study.sweeps.grid import CELL

KEY = ("sweep", *CELL)  # what tells rows apart
ABOUT = ("samples", "steps")  # of the prior, which its name hides
SEAMS = ("seam_lpips", "seam_lpips_low", "seam_lpips_high", "seam_psnr", "seam_jump", "seam_density")
NUMBERS = (*ABOUT, "photos", "gaussians", *QUALITY, *TILES, *SEAMS, *TIMES)


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
    rows = crops.tabulate_crops(cell | {"table": cell["crops"], "variant": cell["tiling"], "replicate": 0})
    row = next(r for r in summary.summarise_crops(rows) if r["view"] == r["ground"] == summary.EVERY)
    named = {"seam_lpips": "cut", "seam_lpips_low": "cut_low", "seam_lpips_high": "cut_high"}
    found = {key: row[name] for key, name in (named | {"seam_psnr": "cut_psnr", "seam_jump": "cut_jump"}).items()}
    facts = read_json(cell["facts"])
    return found | {"seam_density": facts["dense"], "tiles": row["tiles"]} | describe_origin(facts["provenance"])
