"""The paper's values, as printed there: paper.csv, a row a value, by table, row and column.

Source: DAV-GSWT, the tables of timing, levels, sensitivity, ablation and preferences. Its text has slips; `results`
says which.
"""

import re
from pathlib import Path

from dav_gswt import csv_tables

PRINTED = Path(__file__).with_name("paper.csv")
THOUSAND = 1e3


def read_paper() -> dict[tuple[str, str, str], str]:
    """All values, by table, row and column."""
    rows = csv_tables.read_table(PRINTED)
    return {(row["table"], row["row"], row["column"]): row["printed"] for row in rows}


def find_printed(table: str, row: str, columns: tuple[str, ...]) -> dict[str, str | None]:
    """Columns `paper_...` with what is printed in a row; None where the paper has no such row or value."""
    printed = read_paper()
    return {f"paper_{column}": printed.get((table, row, column)) for column in columns}


def parse_number(printed: str) -> float:
    """The number that is printed first: 29.41 of 29.41±0.08, 64200 of 64.2K. Raises: ValueError: there is none."""
    if not (found := re.search(r"\d+(?:\.\d+)?", printed)):
        raise ValueError(f"{printed!r} has no number")
    return float(found[0]) * (THOUSAND if printed.endswith("K") else 1.0)
