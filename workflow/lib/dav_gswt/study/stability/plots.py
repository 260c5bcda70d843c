"""The figure: of every formula, how much of its tolerance it uses, and how much the printed form would."""

from pathlib import Path

import numpy as np

from dav_gswt.study import figures

LEAST, MOST = 1e-6, 1e18  # ends of the axis: what is exact stands at the one, what is not finite at the other
WIDE, ROW = 9.0, 0.215  # inches
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:pink")


def write(path: Path | str, rows: list[dict]) -> None:
    """rows: as read from the table of formulas."""
    figures.save(drawn(rows), path)


def drawn(rows: list[dict]):
    """A row a formula, groups apart: a dot for ours, a cross for the printed form, a line where a tolerance ends."""
    figure = figures.blank(WIDE, 1.3 + ROW * len(rows))
    axes = figure.add_subplot()
    groups = list(dict.fromkeys(row["group"] for row in rows))
    for i, row in enumerate(rows):
        look = {"color": COLOURS[groups.index(row["group"]) % len(COLOURS)], "linestyle": ""}
        axes.plot(_place(row["share_of_tolerance"]), i, marker="o", markersize=5, **look)
        if row["printed_share_of_tolerance"]:
            x = _place(row["printed_share_of_tolerance"])
            axes.plot(x, i, marker="x", markersize=6, markeredgewidth=2, **look)
            note = f"gives {float(row['printed_gives']):.6g} for {float(row['printed_right']):.4g}"
            side = {"xytext": (-8, 0), "ha": "right"} if x > 1e10 else {"xytext": (8, 0), "ha": "left"}
            axes.annotate(note, (x, i), textcoords="offset points", va="center", fontsize=7, **side)
    axes.axvline(1, color="black", linewidth=1)
    axes.set_xscale("log")
    axes.set_xlim(LEAST / 3, MOST * 3)
    axes.set_yticks(range(len(rows)), [row["formula"] for row in rows], fontsize=7.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks([LEAST, 1e-3, 1, 1e3, 1e6, 1e9, 1e12, 1e15, MOST])
    axes.set_xticklabels(["0", "0.001", "1", "1000", "$10^6$", "$10^9$", "$10^{12}$", "$10^{15}$", "$\\infty$"])
    axes.set_xlabel("worst error over its tolerance (dot: ours, cross: as printed or naive)")
    axes.grid(axis="x", alpha=0.3)
    return figure


def _place(share: str) -> float:
    return float(np.clip(float(share), LEAST, MOST))
