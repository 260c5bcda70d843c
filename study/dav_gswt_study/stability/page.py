"""The page of numerical stability: a template filled with the tables of formulas and of runs."""

from pathlib import Path

from dav_gswt_study.markdown import format_table, render_template, write_page


def write_stability_page(
    path: Path | str, template: Path | str, formulas: list[dict], runs: list[dict], facts: dict
) -> None:
    """Write the page. formulas, runs: rows of the tables, as text. facts: their provenance."""
    values = {
        "formulas": format_formulas(formulas),
        "printed": format_printed_forms(formulas),
        "runs": format_runs(runs),
        "within_tolerance": sum(row["finite"] == "True" and float(row["share_of_tolerance"]) <= 1 for row in formulas),
        "formula_count": len(formulas),
        "as_expected": sum(row["as_expected"] == "True" for row in runs),
        "run_count": len(runs),
        "version": facts["version"],
        "renderer": ", ".join(str(value) for value in facts["renderer"].values()),
    }
    write_page(path, render_template(template, values))


def format_formulas(rows: list[dict]) -> str:
    """A table for each group of formulas."""
    header = ("formula", "range", "type", "worst error", "relative", "where", "of its tolerance")
    parts = []
    for group in dict.fromkeys(row["group"] for row in rows):
        lines = [_format_formula(row) for row in rows if row["group"] == group]
        parts.append(f"### {group}\n\n{format_table(header, lines)}")
    return "\n".join(parts)


def _format_formula(row: dict) -> tuple[str, ...]:
    share = float(row["share_of_tolerance"])
    text = f"{share:.2g}" if share <= 1 and row["finite"] == "True" else f"**{share:.2g}**"
    errors = (shorten_number(row["absolute_error"]), shorten_number(row["relative_error"]))
    return (
        f"{row['formula']} ({row['source']})",
        row["range"],
        row["type"],
        *errors,
        row["worst_at"] * bool(share),
        text,
    )


def format_printed_forms(rows: list[dict]) -> str:
    """A table of what the printed forms give at their worst."""
    lines = []
    for row in rows:
        if row["printed_share_of_tolerance"]:
            numbers = (row["printed_gives"], row["printed_right"], row["absolute_error"])
            lines.append((row["formula"], row["printed_at"], *map(shorten_number, numbers)))
    return format_table(("formula", "at", "gives", "expected", "our largest error"), lines)


def format_runs(rows: list[dict]) -> str:
    """A table of the outcomes of all runs."""
    lines = []
    for row in rows:
        expected = "yes" if row["as_expected"] == "True" else "**no**"
        seconds = f"{float(row['seconds']):.0f}"
        lines.append((row["about"], _format_outcome(row), expected, row["gaussians"], seconds, row["peak_mb"]))
    return format_table(("run", "outcome", "as expected", "Gaussians", "seconds", "MB"), lines)


def _format_outcome(row: dict) -> str:
    if row["exit_code"] != "0":
        return f'stopped: "{row["message"]}"' + (" and a traceback" if row["traceback"] == "True" else "")
    text = f"finished; {row['files_checked']} files checked, {row['not_finite']} with numbers that are not finite"
    if row["stills_psnr"]:
        text += f"; stills equal those of {row['like']} to {float(row['stills_psnr']):.0f} dB"
    return text + (f"; warned: {row['warnings']}" if row["warnings"] else "")


def shorten_number(text: str) -> str:
    """A number with two significant digits; whole numbers below 1e7 in full."""
    value = float(text)
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e7 else f"{value:.2g}"
