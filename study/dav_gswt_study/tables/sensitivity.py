"""The paper's table of sensitivity: one setting varied, the others fixed."""

from dav_gswt.paths import encode_number
from dav_gswt_study.tables import paper, spread

MEANS = ("psnr", "lpips", "seam_lpips", "score_s", "orders", "bundle_mb", "stills_s", "render_ms")
VALUES = ("sensitivity", "value")  # table and column of the paper
PRINTED = ("value", "psnr", "seam_lpips", "score_s")


def tabulate_sensitivity(sweeps: dict[str, list[dict]], defaults: dict[str, str]) -> list[dict]:
    """A row for each setting and value: means over scenes and seeds, deviations over seeds, and the paper's values.

    score_s: seconds to score all candidates once, the paper's uncertainty time; stills_s: to draw three stills;
    render_ms: of the viewer, empty where it measured nothing. paper_: the row of the paper with the same value, or,
    where it has other values (k), that of the same place from low to high.
    Args: sweeps: rows of each, with the viewer's, by the setting that it varies; defaults: values where not varied.
    """
    found = []
    for setting, cells in sweeps.items():
        values = sorted({row["varied_0"] for row in cells}, key=float)
        for place, value in enumerate(values):
            mine = [row for row in cells if row["varied_0"] == value]
            row = {"setting": setting, "value": value, "default": value == defaults.get(setting)}
            row |= {"scenes": len({r["scene"] for r in mine}), "cells": len(mine)}
            for key in MEANS:
                row |= spread.mean_and_deviation(mine, key)
            printed = f"{setting}.{_find_place(setting, values, place)}"
            found.append(row | paper.find_printed("sensitivity", printed, PRINTED))
    return found


def _find_place(setting: str, values: list[str], place: int) -> int | None:
    """Which of the paper's rows of a setting stands beside the value at a place of all values."""
    printed = {row: text for (table, row, key), text in paper.read_paper().items() if (table, key) == VALUES}
    known = [encode_number(text) for row, text in printed.items() if row.startswith(f"{setting}.")]
    if set(values) & set(known):
        return known.index(values[place]) if values[place] in known else None
    return place if len(values) == len(known) else None
