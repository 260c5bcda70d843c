"""The figure of a comparison: PSNR against photos, scene by scene, and how far each policy is from the baseline."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from dav_gswt.images import figures
from dav_gswt_study.comparison.tables import EVERY, EVERYTHING

PANEL = 3.3, 3.4  # inches
FOREST = 0.34  # inches a policy
SHOWN = 6  # curves that a panel holds legibly: the baseline and the best
BASE = {"color": "black", "linewidth": 2.4}


def write_figure(path: Path | str, curves: list[dict], compared: list[dict], baseline: str) -> None:
    """Above a panel a scene (and k): PSNR against photos, means over seeds; below every policy less the baseline."""
    compared = [row for row in compared if row["measure"] == "psnr"]
    panels = sorted({(row["scene"], row["k"]) for row in curves if row["policy"] == baseline})
    policies = [row["policy"] for row in _rank_policies(compared)]
    best = policies[: SHOWN - 1]
    looks = {baseline: BASE} | {
        policy: {"color": colour, "linewidth": 1.6} for policy, colour in zip(best, figures.OKABE_ITO, strict=False)
    }
    columns = min(3, len(panels))
    above = -(-len(panels) // columns)
    heights = [PANEL[1] * above, FOREST * len(policies) + 1.3]
    figure = figures.make_figure(PANEL[0] * 3, PANEL[1] * above + FOREST * len(policies) + 1.3)
    top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=heights).ravel()
    grid = top.subplots(above, columns, squeeze=False).ravel()
    for axes, (scene, k) in zip(grid, panels, strict=False):
        _draw_curves(axes, [row for row in curves if row["scene"] == scene], k, looks)
        axes.set_title(f"{scene}, {k} a round", fontsize=10, loc="left")
    for empty in grid[len(panels) :]:
        empty.axis("off")
    handles, labels = grid[0].get_legend_handles_labels()
    top.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    _draw_forest(bottom.subplots(), compared, baseline)
    figures.save_figure(figure, path)


def _draw_curves(axes, rows: list[dict], k: int, looks: dict[str, dict]) -> None:
    for policy, look in looks.items():
        mine = [row for row in rows if row["policy"] == policy and row["k"] == k]
        photos = sorted({row["photos"] for row in mine})
        means = [_mean(mine, lambda row, n=n: row["photos"] == n) for n in photos]
        axes.plot(photos, means, label=policy, marker="o", markersize=3.5, **look)
    everything = [row for row in rows if row["policy"] == EVERYTHING and row["round"] == 1]
    if everything:
        axes.axhline(_mean(everything, lambda row: True), color="0.7", linewidth=1.2, linestyle=":")
        photos = everything[0]["photos"]
        axes.annotate(
            f"all {photos} photos",
            (0.03, _mean(everything, lambda row: True)),
            xycoords=("axes fraction", "data"),
            xytext=(0, -10),  # under the line: above it is the frame
            textcoords="offset points",
            fontsize=8,
        )
    axes.set_xlabel("photos", fontsize=9)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_ylabel("PSNR of test views (dB)", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.3)


def _mean(rows: list[dict], which: Callable[[dict], bool]) -> float:
    return float(np.mean([row["psnr"] for row in rows if which(row)]))


def _rank_policies(compared: list[dict]) -> list[dict]:
    return sorted((row for row in compared if row["scene"] == EVERY), key=lambda row: -row["mean"])


def _draw_forest(axes, compared: list[dict], baseline: str) -> None:
    """A bar a policy, its 95 % interval over all scenes, and a dot a scene."""
    ranked = _rank_policies(compared)
    for place, row in enumerate(ranked):
        if row["low"] is not None:
            axes.plot([row["low"], row["high"]], [place, place], color="0.25", linewidth=2)
        axes.plot(row["mean"], place, "s", color="0.25", markersize=6)
        alone = [r["mean"] for r in compared if r["policy"] == row["policy"] and r["scene"] != EVERY]
        axes.plot(alone, [place] * len(alone), "o", color=figures.OKABE_ITO[0], markersize=4, alpha=0.7)
    axes.axvline(0, color="black", linewidth=1, linestyle=":")
    axes.set_yticks(range(len(ranked)), [row["policy"] for row in ranked], fontsize=9)
    axes.set_ylim(len(ranked) - 0.5, -0.5)
    axes.set_xlabel(
        f"nAUC less that of {baseline} (dB): mean and 95 % interval over scenes, dots are scenes", fontsize=9
    )
    axes.tick_params(axis="x", labelsize=8)
    axes.grid(axis="x", alpha=0.3)
