"""Curves of policies: a table with a row per round of each cell.

A cell is a scene, a seed (of the start photos), a policy with its parameters, and k.
"""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.sweeps import QUALITY as MEASURES
from dav_gswt.sweeps import describe_origin, read_benchmark, select_metrics, sum_or_none
from dav_gswt_study import csv_tables

CELL = ("scene", "seed", "preset", "policy", "prior", "p_drop", "lam", "k")


def read_cell(cell: dict) -> list[dict]:
    """The rows of a cell, the start first.

    cell: what CELL names; `corrected`: PSNR after the photos' exposure is fitted; files: `metrics` of each round, the
    start's first; `times`, for each later round its jobs' benchmarks.
    """
    found = []
    for t, path in enumerate(cell["metrics"]):
        metrics = read_json(path)
        row = {key: cell[key] for key in CELL} | {"round": t, "photos": metrics["photos"]}
        row |= select_metrics(metrics, "psnr_colour_corrected" if cell["corrected"] else "psnr")
        row |= {
            "seconds": sum_or_none(run and run[0] for run in map(read_benchmark, cell["times"][t - 1])) if t else 0.0
        }
        provenance = metrics["provenance"]
        found.append(row | describe_origin(provenance) | {"field": provenance["inputs"]["field"][:12]})
    return found


def read_curves(path: Path | str) -> list[dict]:
    """Read the table of curves."""
    integers = ("seed", "k", "round", "photos")
    return csv_tables.read_table(path, numbers=(*MEASURES, "seconds"), integers=integers)
