"""Results of the forced-choice study: a row for each comparison and scene, for participants and the model observer.

The model observer has rows of its own: of two crops it chooses the one whose middle has the lower Seam-LPIPS over its
floor (`seams.measure`). A crop without a seam has 0. Ties count as half.
"""

from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.images import figures
from dav_gswt_study import statistics
from dav_gswt_study.forced_choice.answers import Participant
from dav_gswt_study.seams.summary import EVERY
from dav_gswt_study.tables import paper

PEOPLE, MODEL = "participants", "model observer (LPIPS)"
MEASURES = ("low", "high", "p", "df", "worth", "binomial_low", "binomial_high", "binomial_p", "median_ms")


def tabulate_choices(key: dict, participants: list[Participant]) -> list[dict]:
    """Rows: first, second, scene, observer, participants, answers, share (of answers that chose the first), and of
    people MEASURES; `paper_preference`, in percent, where the paper has the comparison. Empty where nothing is known.

    Raises: InputError: neither an answer nor LPIPS of any pair.
    """
    rows, pairs = [], {name: item for name, item in key["items"].items() if not item["check"]}
    for first, second in sorted({(item["a"], item["b"]) for item in pairs.values()}):
        mine = {name: item for name, item in pairs.items() if (item["a"], item["b"]) == (first, second)}
        for scene in (EVERY, *sorted({item["scene"] for item in mine.values()})):
            some = {name: item for name, item in mine.items() if scene in (EVERY, item["scene"])}
            about = {"first": first, "second": second, "scene": scene}
            printed = paper.find_printed("perceptual", f"{first} {second}" if scene == EVERY else "", ("preference",))
            rows += [
                about | row | printed for row in (_tabulate_people(some, participants), _tabulate_model(some)) if row
            ]
    if not rows:
        raise InputError(
            "perceptual_study: there are neither answers (`answers` names their folder) nor LPIPS for the model "
            "observer (set `lpips: installed` in the config; then make the kit again)"
        )
    return rows


def _tabulate_people(items: dict[str, dict], participants: list[Participant]) -> dict | None:
    if not participants:
        return None
    chosen = np.array([sum(each.chosen[name] for name in items) for each in participants], float)
    asked = np.full(len(participants), float(len(items)))
    found = statistics.compute_clustered_share(chosen, asked)
    plain = statistics.compute_binomial_test(int(chosen.sum()), found.answers)
    own = (found.low, found.high, found.p, found.df, found.effective_answers)
    times = float(np.median([each.ms[name] for each in participants for name in items]))
    return _row(PEOPLE, found.participants, found.answers, found.share) | dict(
        zip(MEASURES, (*own, *plain, times), strict=True)
    )


def _tabulate_model(items: dict[str, dict]) -> dict | None:
    """The row of the model observer; None where LPIPS was not measured."""
    known = [item["over"] for item in items.values() if None not in item["over"]]
    if not known:
        return None
    share = float(np.mean([0.5 if a == b else float(a < b) for a, b in known]))
    return _row(MODEL, 0, len(known), share)


def _row(observer: str, participants: int, answers: int, share: float) -> dict:
    row = {"observer": observer, "participants": participants, "answers": answers, "share": share}
    return row | dict.fromkeys(MEASURES)


def write_choice_plot(path: Path | str, rows: list[dict]) -> None:
    """A line a comparison: people with their interval, the plain binomial's in grey beneath, dots for scenes; the model
    observer as an open diamond. rows: of `tabulate_choices`.
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
