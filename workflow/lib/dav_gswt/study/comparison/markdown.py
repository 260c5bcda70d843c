"""A comparison as a table to read, for docs/research/results/view-selection.md."""

from pathlib import Path

from dav_gswt.files import atomic_file
from dav_gswt.study.comparison.tables import EVERY
from dav_gswt.study.markdown import format_table


def write_comparison(path: Path | str, compared: list[dict], baseline: str) -> None:
    """Write the table of `format_comparison`."""
    with atomic_file(path) as part:
        part.write_text(format_comparison(compared, baseline), encoding="utf-8")


def format_comparison(compared: list[dict], baseline: str) -> str:
    """Rows of nAUC less the baseline's in dB: a row a policy, best over all scenes first, with a column a scene and k;
    in brackets the 95 % interval, where there is more than one start.
    """
    columns = sorted({(row["scene"], row["k"]) for row in compared} - {(EVERY, "")})
    named = [f"{scene.removesuffix('_pool')}, {k} a round" for scene, k in columns]
    found = {(row["policy"], row["scene"], row["k"]): row for row in compared}
    best = sorted((row for row in compared if row["scene"] == EVERY), key=lambda row: -row["mean"])
    lines = []
    for row in best:
        cells = [_format_cell(found.get((row["policy"], *column))) for column in columns]
        lines.append([f"`{row['policy']}`", *cells, f"{row['wins']}, {row['ties']}, {row['losses']}"])
    return format_table(["less `" + baseline + "`, dB", *named, "wins, ties, losses"], lines)


def _format_cell(row: dict | None) -> str:
    if row is None:
        return ""
    if row["low"] is None:
        return f"{row['mean']:+.2f}"
    return f"{row['mean']:+.2f} ({row['low']:+.2f}, {row['high']:+.2f})"
