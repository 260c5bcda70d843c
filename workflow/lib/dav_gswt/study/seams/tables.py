"""Tables of seams: what each cell measured as one table, and summaries that add up from run to run."""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.study import csv_tables
from dav_gswt.study.seams.summary import CELL

KEYS = (
    (*CELL, "view", "ground"),
    ("variant", "baseline", "measure", "scene", "seed"),
    (*CELL, "east", "north"),
)  # what tells rows of seam_summary, seam_ablation and repetition apart
NUMBERS = ("seam_lpips", "psnr", "jump")


def rows(cell: dict) -> list[dict]:
    """The crops of a cell. cell: what CELL names, the draw, and its files `table` and `facts`.

    Places and crops of another draw of the tiles are other ones: its number is part of their names.
    """
    made = read_json(cell["facts"])["provenance"]
    origin = {
        "version": made["version"],
        "weights": made["inputs"].get("lpips", "")[:12],
        "tiles": made["inputs"]["seams"][:12],
    }
    about, draw = {key: cell[key] for key in (*CELL, "replicate")}, cell["replicate"]
    return [
        about | row | {key: f"{draw}:{row[key]}" if draw else row[key] for key in ("crop", "cluster")} | origin
        for row in read(cell["table"])
    ]


def read(path: Path | str) -> list[dict]:
    """Read a table of seams, measures as numbers; no rows where there is no file yet."""
    rows = csv_tables.read_table(path, numbers=NUMBERS, missing_ok=True)
    return [row | {key: int(row[key]) for key in ("seed", "crop") if row.get(key, "").isdigit()} for row in rows]


def repeats(cell: dict) -> list[dict]:
    """The rows of a cell's autocorrelation."""
    return [{key: cell[key] for key in CELL} | row for row in read(cell["repeats"])]
