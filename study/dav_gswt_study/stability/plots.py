"""Figure of the share of its tolerance that every formula uses, and that its printed form would use."""

from pathlib import Path

import numpy as np

from dav_gswt.images import figures

MIN_SHARE, MAX_SHARE = 1e-6, 1e18  # ends of the axis: exact results are at the left end, infinite errors at the right
WIDTH, ROW_HEIGHT = 9.0, 0.215  # inches
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:pink")


def write_tolerance_plot(path: Path | str, rows: list[dict]) -> None:
    """Write the figure. rows: of the table of formulas, as text."""
    figures.save_figure(plot_tolerances(rows), path)


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
