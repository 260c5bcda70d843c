"""Markdown of pages that rules write."""

from collections.abc import Iterable, Sequence

import pandas as pd


def format_table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; bars inside cells are escaped."""
    cells = [[str(cell).replace("|", "\\|") for cell in row] for row in rows]
    frame = pd.DataFrame(cells, columns=list(header), dtype=str)
    return frame.to_markdown(index=False, tablefmt="github", disable_numparse=True) + "\n"
