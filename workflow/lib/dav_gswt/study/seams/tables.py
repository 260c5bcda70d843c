"""Tables of seams: what each cell measured as one table, and summaries that add up from run to run."""

import csv
from pathlib import Path

from dav_gswt.files import read_json, whole
from dav_gswt.study import figures
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
    about, draw = {key: cell[key] for key in (*CELL, "draw")}, cell["draw"]
    return [
        about | row | {key: f"{draw}:{row[key]}" if draw else row[key] for key in ("crop", "cluster")} | origin
        for row in read(cell["table"])
    ]


def read(path: Path | str) -> list[dict]:
    """Rows that `figures.write_rows` wrote, measures as numbers; no rows where there is no file yet."""
    if not Path(path).is_file():
        return []
    with Path(path).open(newline="", encoding="utf-8") as file:
        return [_typed(row) for row in csv.DictReader(file)]


def _typed(row: dict[str, str]) -> dict:
    out = dict(row)
    for key in NUMBERS:
        if key in row:
            out[key] = float(row[key]) if row[key] else None
    return out | {key: int(row[key]) for key in ("seed", "crop") if row.get(key, "").isdigit()}


def merged(before: list[dict], new: list[dict], key: tuple[str, ...]) -> list[dict]:
    """Rows of both, sorted; of those with the same key the new one. A column that one has not is empty there."""
    columns = list(dict.fromkeys(name for row in [*new, *before] for name in row))
    at = {tuple(str(row[k]) for k in key): row for row in [*before, *new]}
    return [{name: at[k].get(name) for name in columns} for k in sorted(at)]


def repeats(cell: dict) -> list[dict]:
    """The rows of a cell's autocorrelation."""
    return [{key: cell[key] for key in CELL} | row for row in read(cell["repeats"])]


def write(path: Path | str, rows: list[dict]) -> None:
    """Write rows, or where there is none an empty file."""
    if rows:
        figures.write_rows(path, rows)
    else:
        with whole(path) as part:
            part.touch()
