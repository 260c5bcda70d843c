"""How well scores say where the field is wrong, of several scenes and rounds: a table, and a figure of it."""

import numpy as np

from dav_gswt.images import figures
from dav_gswt_study.calibration.agreement import LEVEL

CELL = ("scene", "seed", "preset", "policy", "prior", "p_drop", "round")
MEASURES = ("spearman", "ause", "ause_chance", "coverage", "width")
WIDE, ROW, AROUND = 10.5, 0.42, 2.2  # inches: the figure, a score's row, and what is around the rows
LANES = 0.6  # of a row, over which scenes are spread
MARKS = "os^DvPX*"  # of rounds, in their order
MEAN = {"color": "black", "linewidth": 2.5, "zorder": 1.5, "label": "mean"}
CHANCE = {"color": "0.65", "linewidth": 2.5, "zorder": 1, "label": "chance"}
PANELS = (  # measure, title, value that is marked, another that the axis shows, measure of a score that says nothing
    ("spearman", "Spearman with the error\n0: chance, 1: the best", 0.0, 1.0, None),
    ("ause", "AUSE\n0: the best, grey: chance", 0.0, 0.0, "ause_chance"),
    ("coverage", f"Coverage of {100 * LEVEL:g} % intervals\nthe best: on the line, at {LEVEL:g}", LEVEL, 1.0, None),
)


def tabulate_scores(cells: list[dict], results: list[dict]) -> list[dict]:
    """A row for each score of each cell. cells: what CELL names. results: each one's calibration.json."""
    return [
        {key: cell[key] for key in CELL}
        | {"score": name, "poses": found["poses"]}
        | {key: judged.get(key) for key in MEASURES}
        for cell, found in zip(cells, results, strict=True)
        for name, judged in found["scores"].items()
    ]


def draw_figure(table: list[dict]):
    """A panel a measure: a row a score, the best on top; a dot a cell, its colour the scene, its shape the round; a
    black bar at the mean, a grey one at chance."""
    names = _rank_scores(table)
    figure = figures.make_figure(WIDE, AROUND + ROW * len(names), w_pad=0.08, h_pad=0.1)
    panels = figure.subplots(1, len(PANELS), sharey=True)
    for axes, panel in zip(panels, PANELS, strict=True):
        _draw_panel(axes, panel, table, names)
    shown = {label: line for line, label in zip(*panels[1].get_legend_handles_labels(), strict=True)}
    figure.legend(shown.values(), shown, loc="outside lower center", ncols=4, frameon=False, fontsize=10)
    return figure


def _rank_scores(table: list[dict]) -> list[str]:
    """Scores, those of the greatest mean first; those without a value last."""
    means = {row["score"]: _mean(table, row["score"], "spearman") for row in table}
    return sorted(means, key=lambda name: -np.inf if (mean := means[name]) is None else mean, reverse=True)


def _mean(table: list[dict], score: str, measure: str) -> float | None:
    values = [row[measure] for row in table if row["score"] == score and row[measure] is not None]
    return float(np.mean(values)) if values else None


def _draw_panel(axes, panel: tuple, table: list[dict], names: list[str]) -> None:
    measure, title, line, to, chance = panel
    scenes, rounds = (sorted({row[key] for row in table}) for key in ("scene", "round"))
    for row in table:
        if row[measure] is not None:
            scene, t = scenes.index(row["scene"]), rounds.index(row["round"])
            place = names.index(row["score"]) + LANES * ((scene + 0.5) / len(scenes) - 0.5)
            look = {
                "color": f"C{scene}",
                "marker": MARKS[t % len(MARKS)],
                "label": f"{row['scene']}, round {row['round']}",
            }
            axes.plot(row[measure], place, linestyle="", markersize=7.5, markeredgecolor="white", **look)
    for place, name in enumerate(names):
        for key, look in ((chance, CHANCE), (measure, MEAN)):
            if key and (mean := _mean(table, name, key)) is not None:
                axes.vlines(mean, place - 0.42, place + 0.42, **look)
        axes.axhline(place + 0.5, color="0.85", linewidth=0.8)
    axes.axvline(line, color="black", linewidth=1, linestyle=":")
    axes.update_datalim([(line, 0), (to, 0)])
    axes.margins(x=0.08)
    axes.autoscale_view(scaley=False)
    axes.set_title(title, fontsize=12, loc="left")
    axes.set_yticks(range(len(names)), names, fontsize=12)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(labelsize=12)
    axes.grid(axis="x", alpha=0.3)
