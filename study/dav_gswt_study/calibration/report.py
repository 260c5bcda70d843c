"""How well scores say where the field is wrong, of several scenes and rounds: a table, and a figure of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dav_gswt.images import figures

CELL = ("scene", "seed", "preset", "policy", "prior", "p_drop", "round")
MEASURES = ("spearman", "ause", "ause_chance", "coverage", "width", "pixel_spearman", "pixel_ause", "pixel_ause_chance")
WIDE, ROW, AROUND = 10.5, 0.42, 1.4  # inches: the figure, a score's row in a panel, and what is around a panel's rows
LANES = 0.6  # of a row, over which scenes are spread
MARKS = "os^DvPX*"  # of rounds, in their order
MEAN = {"color": "black", "linewidth": 2.5, "zorder": 1.5}
CHANCE = {"color": "0.65", "linewidth": 2.5, "zorder": 1}


@dataclass(frozen=True)
class Panel:
    """One measure of the figure. line: a value that is marked, with its meaning in the title. to: the axis shows at
    least what is between the two. chance: the measure of a score that says nothing."""

    measure: str
    title: str
    line: float
    to: float
    chance: str | None = None


def tabulate_scores(cells: list[dict], results: list[dict]) -> list[dict]:
    """A row for each score of each cell. cells: what CELL names. results: each one's calibration.json."""
    return [
        {key: cell[key] for key in CELL}
        | {"score": name, "poses": found["poses"]}
        | {key: judged.get(key) for key in MEASURES}
        for cell, found in zip(cells, results, strict=True)
        for name, judged in found["scores"].items()
    ]


def write_figure(path: Path | str, table: list[dict], level: float) -> None:
    """The figure of `tabulate_scores`, as a PNG. level: of the intervals."""
    figures.save_figure(draw_figure(table, level), path)


def draw_figure(table: list[dict], level: float):
    """A panel a measure, of poses above and (where there are any) of pixels below: a row a score, the best on top; a
    dot a cell, its colour the scene, its shape the round; a black bar at the mean, a grey one at chance."""
    poses, pixels = _panels(level)
    layers = [(poses, _rank_scores(table, "spearman")), (pixels, _rank_scores(table, "pixel_spearman", known=True))]
    layers = [(panels, names) for panels, names in layers if names]
    tall = [AROUND + ROW * len(names) for _, names in layers]
    figure = figures.make_figure(WIDE, sum(tall) + 0.4, w_pad=0.08, h_pad=0.1)
    grid = figure.subplots(len(layers), 3, squeeze=False, height_ratios=tall)
    looks = _assign_styles(table)
    for axes, (panels, names) in zip(grid, layers, strict=True):
        for side, panel in zip(axes, panels, strict=False):
            _draw_panel(side, panel, table, names, looks)
            side.tick_params(labelleft=side is axes[0])
        for empty in axes[len(panels) :]:
            empty.axis("off")
    figure.legend(handles=_legend_handles(looks), loc="outside lower center", ncols=5, frameon=False, fontsize=11)
    return figure


def _panels(level: float) -> tuple[list[Panel], list[Panel]]:
    rank, area = "Spearman with the error\n0: chance, 1: the best", "AUSE\n0: the best, grey: chance"
    covered = f"Coverage of {100 * level:g} % intervals\nthe best: on the line, at {level:g}"
    poses = [
        Panel("spearman", f"POSES  {rank}", 0.0, 1.0),
        Panel("ause", area, 0.0, 0.0, "ause_chance"),
        Panel("coverage", covered, level, 1.0),
    ]
    pixels = [
        Panel("pixel_spearman", f"PIXELS  {rank}", 0.0, 1.0),
        Panel("pixel_ause", area, 0.0, 0.0, "pixel_ause_chance"),
    ]
    return poses, pixels


def _rank_scores(table: list[dict], measure: str, known: bool = False) -> list[str]:
    """Scores, those of the greatest mean first; those without a value last, or (known) left out."""
    means = {row["score"]: _mean(table, row["score"], measure) for row in table}
    names = [name for name, mean in means.items() if mean is not None or not known]
    order = {name: -np.inf if mean is None else mean for name, mean in means.items()}
    return sorted(names, key=lambda name: order[name], reverse=True)


def _mean(table: list[dict], score: str, measure: str) -> float | None:
    values = [row[measure] for row in table if row["score"] == score and row[measure] is not None]
    return float(np.mean(values)) if values else None


def _draw_panel(axes, panel: Panel, table: list[dict], names: list[str], looks: dict[str, dict]) -> None:
    known = [row for row in table if row[panel.measure] is not None]
    for row in known:
        place = names.index(row["score"]) + looks["lane"][row["scene"]]
        look = {"color": looks["colour"][row["scene"]], "marker": looks["mark"][row["round"]]}
        axes.plot(row[panel.measure], place, linestyle="", markersize=7.5, markeredgecolor="white", **look)
    for place, name in enumerate(names):
        for measure, look in ((panel.chance, CHANCE), (panel.measure, MEAN)):
            if measure and (mean := _mean(table, name, measure)) is not None:
                axes.vlines(mean, place - 0.42, place + 0.42, **look)
    if not known:
        axes.text(0.5, 0.5, "too few poses", transform=axes.transAxes, ha="center", va="center", fontsize=12)
    axes.axvline(panel.line, color="black", linewidth=1, linestyle=":")
    axes.update_datalim([(panel.line, 0), (panel.to, 0)])
    axes.margins(x=0.08)
    axes.autoscale_view(scaley=False)
    axes.set_title(panel.title, fontsize=12, loc="left")
    axes.set_yticks(range(len(names)), names, fontsize=12)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(labelsize=12)
    axes.grid(axis="x", alpha=0.3)
    for edge in range(1, len(names)):
        axes.axhline(edge - 0.5, color="0.85", linewidth=0.8)


def _assign_styles(table: list[dict]) -> dict[str, dict]:
    """Each scene's colour and lane within a row, each round's mark."""
    from matplotlib import colormaps

    scenes, rounds = (sorted({row[key] for row in table}) for key in ("scene", "round"))
    chosen = colormaps["tab10" if len(scenes) <= 10 else "tab20"]
    return {
        "colour": {scene: chosen(i % chosen.N) for i, scene in enumerate(scenes)},
        "lane": {scene: LANES * ((i + 0.5) / len(scenes) - 0.5) for i, scene in enumerate(scenes)},
        "mark": {number: MARKS[i % len(MARKS)] for i, number in enumerate(rounds)},
    }


def _legend_handles(looks: dict[str, dict]) -> list:
    from matplotlib.lines import Line2D

    dot = {"linestyle": "", "markersize": 8}
    scenes = [Line2D([], [], marker="o", color=c, label=s, **dot) for s, c in looks["colour"].items()]
    rounds = [Line2D([], [], marker=m, color="0.3", label=f"round {t}", **dot) for t, m in looks["mark"].items()]
    bar = {"linestyle": "", "marker": "|", "markersize": 14, "markeredgewidth": 2.5}
    bars = [Line2D([], [], color=look["color"], label=of, **bar) for of, look in (("mean", MEAN), ("chance", CHANCE))]
    return scenes + rounds + bars
