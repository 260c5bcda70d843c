"""Write CSV tables: floats with five significant digits, an empty field for a value that is not known."""

import csv
from collections.abc import Iterable
from pathlib import Path

from dav_gswt.files import atomic_file


def write_table(path: Path | str, rows: Iterable[dict]) -> None:
    """Write rows under the columns of the first one; no rows give an empty file.

    Raises: ValueError: a row has a column that the first one lacks.
    """
    rows = list(rows)
    with atomic_file(path) as part, part.open("w", encoding="utf-8", newline="") as text:
        if rows:
            writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows({name: _format(value) for name, value in row.items()} for row in rows)


def _format(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.5g}" if isinstance(value, float) else str(value)
