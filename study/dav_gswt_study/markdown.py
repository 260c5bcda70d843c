"""Markdown of pages that rules write: tables, and templates."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import jinja2
import pandas as pd

import dav_gswt
from dav_gswt.files import atomic_file


def format_table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; bars inside cells are escaped."""
    cells = [[str(cell).replace("|", "\\|") for cell in row] for row in rows]
    frame = pd.DataFrame(cells, columns=list(header), dtype=str)
    return frame.to_markdown(index=False, tablefmt="github", disable_numparse=True) + "\n"


def render_template(template: Path | str, values: dict) -> str:
    """A Jinja2 template filled with values. Raises: jinja2.UndefinedError: a value is missing."""
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, keep_trailing_newline=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.globals["version"] = dav_gswt.__version__  # for tables that do not say it
    return environment.from_string(Path(template).read_text(encoding="utf-8")).render(values)


def write_page(path: Path | str, template: Path | str, values: dict) -> None:
    """Write a template filled with values, whole or not at all. Raises: as `render_template`."""
    with atomic_file(path) as part:
        part.write_text(render_template(template, values), encoding="utf-8")


def format_number(value: float | None, digits: int) -> str:
    """A value with so many digits after the point; empty for None."""
    return "" if value is None else f"{value:.{digits}f}"
