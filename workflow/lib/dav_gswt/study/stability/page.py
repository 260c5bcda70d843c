"""The page docs/research/results/stability.md: a template's text, with the tables."""

from pathlib import Path

from dav_gswt.files import whole
from dav_gswt.study.markdown import format_table


def write(path: Path | str, template: Path | str, formulas: list[dict], runs: list[dict], facts: dict) -> None:
    """Fill the template's places: {formulas}, {printed}, {runs}, {counts} and where it all comes from.

    formulas, runs: rows as read from the tables. facts: their provenance.
    """
    text = Path(template).read_text(encoding="utf-8")
    renderer = ", ".join(str(value) for value in facts["renderer"].values())
    found = {
        "formulas": formula_tables(formulas),
        "printed": printed_table(formulas),
        "runs": run_table(runs),
        "held": sum(row["finite"] == "True" and float(row["share_of_tolerance"]) <= 1 for row in formulas),
        "count": len(formulas),
        "expected": sum(row["as_expected"] == "True" for row in runs),
        "ran": len(runs),
        "version": facts["version"],
        "renderer": renderer,
    }
    with whole(path) as part:
        part.write_text(text.format(**found), encoding="utf-8")


def formula_tables(rows: list[dict]) -> str:
    """A table for each group."""
    parts = []
    head = ("formula", "range", "kept or computed in", "worst error", "relative", "where", "of its tolerance")
    for group in dict.fromkeys(row["group"] for row in rows):
        parts.append(f"### {group}\n\n{format_table(head, [_formula(row) for row in rows if row['group'] == group])}")
    return "\n".join(parts)


def _formula(row: dict) -> tuple[str, ...]:
    name = f"{row['formula']} ({row['source']})"
    share = float(row["share_of_tolerance"])
    held = f"{share:.2g}" if share <= 1 and row["finite"] == "True" else f"**{share:.2g}**"
    numbers = (number(row["absolute_error"]), number(row["relative_error"]))
    return name, row["range"], row["type"], *numbers, row["worst_at"] if share else "", held


def printed_table(rows: list[dict]) -> str:
    """What the forms give that are not used."""
    lines = []
    for row in rows:
        if row["printed_share_of_tolerance"]:
            values = (number(row["printed_gives"]), number(row["printed_right"]), number(row["absolute_error"]))
            lines.append((row["formula"], row["printed_at"], *values))
    return format_table(("formula", "at", "gives", "right is", "ours is off by, at worst"), lines)


def run_table(rows: list[dict]) -> str:
    """What came of each run."""
    lines = []
    for row in rows:
        good = "yes" if row["as_expected"] == "True" else "**no**"
        lines.append(
            (row["about"], _outcome(row), good, row["gaussians"], f"{float(row['seconds']):.0f}", row["peak_mb"])
        )
    return format_table(("run", "what came of it", "as expected", "Gaussians", "seconds", "MB"), lines)


def _outcome(row: dict) -> str:
    if row["exit_code"] != "0":
        return f'stopped: "{row["message"]}"' + (" and a traceback" if row["traceback"] == "True" else "")
    said = f"ended; {row['files_checked']} files of numbers, {row['not_finite']} with one that is not finite"
    if row["stills_psnr"]:
        said += f"; stills as those of {row['like']} to {float(row['stills_psnr']):.0f} dB"
    return said + (f"; said: {row['warnings']}" if row["warnings"] else "")


def number(text: str) -> str:
    """A number to two digits, longer where it is whole and short."""
    value = float(text)
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e7 else f"{value:.2g}"
