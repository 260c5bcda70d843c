"""Tables of seams: crops of all experiments as one table, and the keys of tables that grow from run to run."""

from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.files import read_json
from dav_gswt_study.seams.summary import CELL

KEYS = (
    (*CELL, "view", "ground"),
    ("variant", "baseline", "measure", "scene", "seed"),
    (*CELL, "east", "north"),
)  # keys of the tables seam_summary, seam_ablation and repetition
NUMBERS = ("seam_lpips", "psnr", "jump")


def tabulate_crops(cell: dict) -> list[dict]:
    """The crops of an experiment. cell: the values of CELL, `replicate`, and its files `table` and `facts`.

    Crops and clusters of different replicates of the tiles differ: the replicate is part of their names.
    """
    made = read_json(cell["facts"])["provenance"]
    origin = {
        "version": made["version"],
        "weights": made["inputs"].get("lpips", "")[:12],
        "tiles": made["inputs"]["seams"][:12],
    }
    about, number = {key: cell[key] for key in (*CELL, "replicate")}, cell["replicate"]
    return [
        about | row | {key: f"{number}:{row[key]}" if number else row[key] for key in ("crop", "cluster")} | origin
        for row in read_seam_table(cell["table"])
    ]


def read_seam_table(path: Path | str) -> list[dict]:
    """Read a table of seams, measures as numbers; no rows where there is no file yet."""
    rows = csv_tables.read_table(path, numbers=NUMBERS, missing_ok=True)
    return [row | {key: int(row[key]) for key in ("seed", "crop") if row.get(key, "").isdigit()} for row in rows]


def tabulate_repetition(cell: dict) -> list[dict]:
    """The rows of an experiment's autocorrelation."""
    return [{key: cell[key] for key in CELL} | row for row in read_seam_table(cell["repeats"])]
