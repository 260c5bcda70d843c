"""Results of the forced-choice study: a row for each comparison and scene."""

from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.images import figures
from dav_gswt_study import plots, statistics
from dav_gswt_study.forced_choice.answers import Participant
from dav_gswt_study.seams.summary import EVERY
from dav_gswt_study.tables import paper

MEASURES = ("low", "high", "p", "df", "worth", "binomial_low", "binomial_high", "binomial_p", "median_ms")


def tabulate_choices(key: dict, participants: list[Participant]) -> list[dict]:
    """Rows: first, second, scene, participants, answers, share (of answers that chose the first), MEASURES; and
    `paper_preference`, in percent, where the paper has the comparison. Empty where nothing is known.

    Raises: InputError: nobody answered.
    """
    if not participants:
        raise InputError("forced_choice: there are no answers that count; `answers` in the config names their folder")
    rows, pairs = [], {name: item for name, item in key["items"].items() if not item["check"]}
    for first, second in sorted({(item["a"], item["b"]) for item in pairs.values()}):
        mine = {name: item for name, item in pairs.items() if (item["a"], item["b"]) == (first, second)}
        for scene in (EVERY, *sorted({item["scene"] for item in mine.values()})):
            some = {name: item for name, item in mine.items() if scene in (EVERY, item["scene"])}
            printed = paper.find_printed("perceptual", f"{first} {second}" if scene == EVERY else "", ("preference",))
            about = {"first": first, "second": second, "scene": scene}
            rows.append(about | _summarise_answers(some, participants) | printed)
    return rows


def _summarise_answers(items: dict[str, dict], participants: list[Participant]) -> dict:
    chosen = np.array([sum(each.chosen[name] for name in items) for each in participants], float)
    found = statistics.compute_clustered_share(chosen, np.full(len(participants), float(len(items))))
    plain = statistics.compute_binomial_test(int(chosen.sum()), found.answers)
    times = float(np.median([each.ms[name] for each in participants for name in items]))
    row = {"participants": found.participants, "answers": found.answers, "share": found.share}
    values = (found.low, found.high, found.p, found.df, found.effective_answers, *plain, times)
    return row | dict(zip(MEASURES, values, strict=True))


def write_choice_plot(path: Path | str, rows: list[dict]) -> None:
    """A line a comparison: all participants with their interval, the plain binomial's in grey beneath, and dots for
    scenes. rows: of `tabulate_choices`.
    """
    overall = [row for row in rows if row["scene"] == EVERY]
    names = [f"{row['first']} over {row['second']}" for row in overall]
    found = [(row["share"], row["low"], row["high"]) for row in overall]
    scenes = [
        [row["share"] for row in rows if row["scene"] != EVERY and row["first"] == a and row["second"] == b]
        for a, b in ((row["first"], row["second"]) for row in overall)
    ]
    figure = figures.make_figure(8.0, 1.6 + 0.7 * len(names))
    axes = figure.add_subplot()
    for place, row in enumerate(overall):
        axes.plot([row["binomial_low"], row["binomial_high"]], [place + 0.2] * 2, color="0.65", linewidth=2)
    plots.draw_forest(axes, names, found, scenes, middle=0.5)
    axes.set_xlim(-0.02, 1.02)
    people = f"share of answers of {overall[0]['participants']} participants that chose the first"
    axes.set_xlabel(f"{people}: 95 % intervals, grey: the plain binomial's; dots are scenes", fontsize=9)
    figures.save_figure(figure, path)
