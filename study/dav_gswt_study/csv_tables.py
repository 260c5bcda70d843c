"""Read, write and merge CSV tables.

A table is a list of rows, a row a dict from column to value. Files keep the format of `write_table`.
"""

import csv
from collections.abc import Collection
from pathlib import Path

from dav_gswt.files import write_table


def read_table(
    path: Path | str,
    *,
    numbers: Collection[str] = (),
    integers: Collection[str] = (),
    texts: Collection[str] | None = None,
    missing_ok: bool = False,
) -> list[dict]:
    """Read a table: `numbers` as float, `integers` as int, both None where a field is empty, other columns as text.

    texts: if given, all columns but these are numbers. missing_ok: a file that does not exist has no rows.
    """
    path = Path(path)
    if missing_ok and not path.is_file():
        return []
    if path.stat().st_size == 0:
        return []
    with path.open(encoding="utf-8", newline="") as text:
        columns, *rows = csv.reader(text)
    if texts is not None:
        numbers = [*numbers, *(name for name in columns if name not in (*texts, *integers))]
    kinds = dict.fromkeys(numbers, float) | dict.fromkeys(integers, int)
    return [{n: _parse(value, kinds.get(n)) for n, value in zip(columns, row, strict=True)} for row in rows if row]


def merge_rows(before: list[dict], new: list[dict], key: Collection[str]) -> list[dict]:
    """Rows of both, sorted by key; of two rows with the same key the new one stays.

    Columns are those of the new rows, then what only old rows have; a value that a row lacks is None.
    """
    columns = list(dict.fromkeys(name for row in [*new, *before] for name in row))
    at = {tuple(str(row[name]) for name in key): row for row in [*before, *new]}
    return [{name: at[k].get(name) for name in columns} for k in sorted(at)]


def update_table(path: Path | str, rows: list[dict], key: Collection[str]) -> None:
    """Add rows to a table that grows from run to run; rows with the same key are replaced."""
    write_table(path, merge_rows(read_table(path, missing_ok=True), rows, key))


def _parse(text: str, kind: type | None) -> str | float | int | None:
    if kind is None:
        return text
    return kind(text) if text else None
