"""Results of the forced-choice study: a row for each comparison and scene, for participants and the model observer.

The model observer has rows of its own: of two crops it chooses the one whose middle has the lower Seam-LPIPS over its
floor (`seams.measure`). A crop without a seam has 0. Ties count as half.
"""

import numpy as np

from dav_gswt.errors import InputError
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
