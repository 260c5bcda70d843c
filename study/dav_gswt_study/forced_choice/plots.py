"""The figure of the study: how often participants and the model observer chose the first of two."""

from pathlib import Path

from dav_gswt.images import figures
from dav_gswt_study.forced_choice.results import MODEL, PEOPLE
from dav_gswt_study.seams.summary import EVERY


def write_choice_plot(path: Path | str, rows: list[dict]) -> None:
    """A line a comparison: people with their interval, the plain binomial's in grey beneath, dots for scenes; the model
    observer as an open diamond. rows: of `results.tabulate_choices`.
    """
    pairs = sorted({(row["first"], row["second"]) for row in rows})
    figure = figures.make_figure(8.0, 1.6 + 0.7 * len(pairs))
    axes = figure.add_subplot()
    for place, pair in enumerate(pairs):
        mine = [row for row in rows if (row["first"], row["second"]) == pair]
        _plot_people(axes, place, [row for row in mine if row["observer"] == PEOPLE])
        for row in mine:
            if row["observer"] == MODEL and row["scene"] == EVERY:
                axes.plot(
                    row["share"],
                    place + 0.22,
                    "D",
                    color="#d55e00",
                    markerfacecolor="none",
                    label=_label_once(axes, MODEL),
                )
    axes.axvline(0.5, color="black", linewidth=1, linestyle=":")
    axes.set_yticks(range(len(pairs)), [f"{first} over {second}" for first, second in pairs], fontsize=9)
    axes.set_ylim(len(pairs) - 0.5, -0.5)
    axes.set_xlim(-0.02, 1.02)
    people = max(row["participants"] for row in rows)
    axes.set_xlabel(f"share of answers that chose the first; participants {people}", fontsize=9)
    axes.grid(axis="x", alpha=0.3)
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figures.save_figure(figure, path)


def _plot_people(axes, place: int, rows: list[dict]) -> None:
    for row in rows:
        if row["scene"] != EVERY:
            axes.plot(
                row["share"], place, "o", color="#0072b2", markersize=4, alpha=0.6, label=_label_once(axes, "one scene")
            )
            continue
        ends = [row["binomial_low"], row["binomial_high"]]
        axes.plot(ends, [place - 0.22] * 2, color="0.65", linewidth=2, label=_label_once(axes, "plain binomial, 95 %"))
        if row["low"] is not None:
            label = _label_once(axes, "participants, 95 %")
            axes.plot([row["low"], row["high"]], [place, place], color="0.25", linewidth=2, label=label)
        axes.plot(row["share"], place, "s", color="0.25", markersize=6)


def _label_once(axes, label: str) -> str:
    """The label where it is the first, else none."""
    return "_" if label in axes.get_legend_handles_labels()[1] else label
