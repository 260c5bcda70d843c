"""The page of numerical stability: a template filled with the tables of formulas and of runs, and its figure."""

import numpy as np

from dav_gswt.images import figures
from dav_gswt_study.markdown import format_table

MIN_SHARE, MAX_SHARE = 1e-6, 1e18  # ends of the axis: exact results are at the left end, infinite errors at the right
WIDTH, ROW_HEIGHT = 9.0, 0.215  # inches
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:pink")


def describe_stability(formulas: list[dict], runs: list[dict], facts: dict) -> dict:
    """The values of the page's template. formulas, runs: rows of the tables, as text. facts: their provenance."""
    return {
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


def format_formulas(rows: list[dict]) -> str:
    """A table for each group of formulas."""
    header = ("formula", "range", "type", "largest error", "largest relative error", "inputs nearest to the tolerance")
    header += ("share of the tolerance there",)
    parts = []
    for group in dict.fromkeys(row["group"] for row in rows):
        lines = [_format_formula(row) for row in rows if row["group"] == group]
        parts.append(f"### {group}\n\n{format_table(header, lines)}")
    return "\n".join(parts)


def _format_formula(row: dict) -> tuple[str, ...]:
    share = float(row["share_of_tolerance"])
    text = f"{share:.2g}" if share <= 1 and row["finite"] == "True" else f"**{share:.2g}**"
    errors = (shorten_number(row[name]) for name in ("absolute_error", "relative_error"))
    about = f"{row['formula']} ({row['source']})", row["range"], row["type"]
    return (*about, *errors, row["worst_at"] * bool(share), text)


def format_printed_forms(rows: list[dict]) -> str:
    """A table of what the printed forms give at their worst."""
    lines = []
    for row in rows:
        if row["printed_share_of_tolerance"]:
            numbers = (row["printed_gives"], row["printed_right"], row["absolute_error"])
            lines.append((row["formula"], row["printed_at"], *map(shorten_number, numbers)))
    head = ("formula", "input", "printed form gives", "right result", "largest error of our form")
    return format_table(head, lines)


def format_runs(rows: list[dict]) -> str:
    """A table of the outcomes of all runs."""
    lines = []
    for row in rows:
        expected = "yes" if row["as_expected"] == "True" else "**no**"
        seconds = f"{float(row['seconds']):.0f}"
        lines.append((row["about"], _format_outcome(row), expected, row["gaussians"], seconds, row["peak_mb"]))
    return format_table(("run", "outcome", "as expected", "Gaussians", "seconds", "peak memory (MB)"), lines)


def _format_outcome(row: dict) -> str:
    if row["exit_code"] != "0":
        return f'stopped: "{row["message"]}"' + (" and a traceback" if row["traceback"] == "True" else "")
    text = f"finished; {row['files_checked']} files checked, {row['not_finite']} with numbers that are not finite"
    if row["stills_psnr"]:
        text += f"; its stills agree with the stills of the usual size to {float(row['stills_psnr']):.0f} dB"
    return text + (f"; warned: {row['warnings']}" if row["warnings"] else "")


def shorten_number(text: str) -> str:
    """A number with two significant digits; whole numbers below 1e7 in full."""
    value = float(text)
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e7 else f"{value:.2g}"


def plot_tolerances(rows: list[dict]):
    """A line for each formula, a colour for each group: a dot for ours, a cross for the printed form."""
    figure = figures.make_figure(WIDTH, 1.3 + ROW_HEIGHT * len(rows))
    axes = figure.add_subplot()
    groups = list(dict.fromkeys(row["group"] for row in rows))
    for i, row in enumerate(rows):
        colour = COLOURS[groups.index(row["group"]) % len(COLOURS)]
        axes.plot(_clip_share(row["share_of_tolerance"]), i, marker="o", markersize=5, color=colour, linestyle="")
        if row["printed_share_of_tolerance"]:
            x = _clip_share(row["printed_share_of_tolerance"])
            axes.plot(x, i, marker="x", markersize=6, markeredgewidth=2, color=colour, linestyle="")
            label = f"gives {float(row['printed_gives']):.6g} for {float(row['printed_right']):.4g}"
            offset = {"xytext": (-8, 0), "ha": "right"} if x > 1e10 else {"xytext": (8, 0), "ha": "left"}
            axes.annotate(label, (x, i), textcoords="offset points", va="center", fontsize=7, **offset)
    axes.axvline(1, color="black", linewidth=1)
    axes.set_xscale("log")
    axes.set_xlim(MIN_SHARE / 3, MAX_SHARE * 3)
    axes.set_yticks(range(len(rows)), [row["formula"] for row in rows], fontsize=7.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks([MIN_SHARE, 1e-3, 1, 1e3, 1e6, 1e9, 1e12, 1e15, MAX_SHARE])
    axes.set_xticklabels(["0", "0.001", "1", "1000", "$10^6$", "$10^9$", "$10^{12}$", "$10^{15}$", "$\\infty$"])
    axes.set_xlabel("worst error over its tolerance (dot: ours, cross: as printed or naive)")
    axes.grid(axis="x", alpha=0.3)
    return figure


def _clip_share(share: str) -> float:
    return float(np.clip(float(share), MIN_SHARE, MAX_SHARE))
