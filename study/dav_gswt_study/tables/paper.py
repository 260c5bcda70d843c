"""The paper's tables of timing, sensitivity and ablation from our runs, and the paper's values beside them.

paper.csv has the values as printed, a row a value, by table, row and column. Source: DAV-GSWT, the tables of timing,
levels, sensitivity, ablation and preferences. Its text has slips; the template of the page of results says which.
"""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from dav_gswt.paths import encode_number
from dav_gswt_study import csv_tables, statistics
from dav_gswt_study.tables.spread import VIEWER, mean_and_deviation

PAPER = Path(__file__).with_name("paper.csv")
MEGA, MINUTE = 1e6, 60.0
FRAMES = ("render_ms", "sort_ms", "sort_share", "update_ms", "update_share")
TIMED = ("splats_m", "recon_min", "cut_s", "presort_s", *FRAMES)
VARIED = ("psnr", "lpips", "seam_lpips", "score_s", "orders", "bundle_mb", "stills_s", "render_ms")
ABLATED = ("psnr", "lpips", "seam_lpips", "seam_psnr", "seam_density", "peak_mb", "render_ms", "score_s", "recon_s")
TESTED = ("psnr", "seam_lpips")  # measures of the ablation that are tested


def read_paper() -> dict[tuple[str, str, str], str]:
    """All values, by table, row and column."""
    return {(row["table"], row["row"], row["column"]): row["printed"] for row in csv_tables.read_table(PAPER)}


def find_printed(table: str, row: str, columns: tuple[str, ...]) -> dict[str, str | None]:
    """Columns `paper_...` with what is printed in a row; None where the paper has no such row or value."""
    printed = read_paper()
    return {f"paper_{column}": printed.get((table, row, column)) for column in columns}


def tabulate_timing(cells: list[dict], value: str, families: dict[str, str]) -> list[dict]:
    """A row for each scene, means over its seeds.

    splats_m: Gaussians of all tiles and levels; recon_min: from photos with their cameras to the last round's field
    (taking photos not counted); cut_s: tiles; presort_s: the bundle with its orders. The viewer's columns are empty
    where it measured nothing; its shares are of frames in which the worker ran; the paper leaves open what its are of.
    Args: cells: of a sweep, with the viewer's, of which those at `value` count (at its first, if it has not that one);
    families: of synthetic scenes, as the paper's.
    """
    at = value if any(row["varied_0"] == value for row in cells) else cells[0]["varied_0"]
    cells, found = [row for row in cells if row["varied_0"] == at], []
    for scene in list[str](dict.fromkeys(row["scene"] for row in cells)):
        mine = [row for row in cells if row["scene"] == scene]
        means: dict[str, float | None] = {}
        for key in ("recon_s", "levels_s", "cut_s", "bundle_s"):
            means |= mean_and_deviation(mine, key)
        means |= {key: mean_and_deviation(mine, key)[key] for key in ("photos", "splats", *VIEWER, "peak_mb")}
        row = {"scene": scene, "preset": mine[0]["preset"], "seeds": len(mine), "photos": means["photos"]}
        row |= {"splats_m": _over(means["splats"], MEGA), "recon_min": _over(means["recon_s"], MINUTE)}
        row |= {"recon_min_sd": _over(means["recon_s_sd"], MINUTE)}
        row |= {key: means[key] for key in ("levels_s", "levels_s_sd", "cut_s", "cut_s_sd")}
        row |= {"presort_s": means["bundle_s"], "presort_s_sd": means["bundle_s_sd"]}
        row |= {key: means[key] for key in (*VIEWER, "peak_mb")}
        found.append(row | find_printed("timing", families.get(scene, scene), TIMED))
    return found


def _over(value: float | None, unit: float) -> float | None:
    return None if value is None else value / unit


def tabulate_sensitivity(sweeps: dict[str, list[dict]], defaults: dict[str, str]) -> list[dict]:
    """A row for each setting and value: means over scenes and seeds, deviations over seeds, and the paper's values.

    score_s: seconds to score all candidates once, the paper's uncertainty time; stills_s: to draw three stills;
    render_ms: of the viewer, empty where it measured nothing. paper_: the paper's row for the same value, or,
    where its values differ (k), the row of the same rank.
    Args: sweeps: rows of each, with the viewer's, by the setting that it varies; defaults: values where not varied.
    """
    found = []
    for setting, cells in sweeps.items():
        values = sorted({row["varied_0"] for row in cells}, key=float)
        for place, value in enumerate(values):
            mine = [row for row in cells if row["varied_0"] == value]
            row = {"setting": setting, "value": value, "default": value == defaults.get(setting)}
            row |= {"scenes": len({r["scene"] for r in mine}), "cells": len(mine)}
            for key in VARIED:
                row |= mean_and_deviation(mine, key)
            printed = f"{setting}.{_find_place(setting, values, place)}"
            found.append(row | find_printed("sensitivity", printed, ("value", "psnr", "seam_lpips", "score_s")))
    return found


def _find_place(setting: str, values: list[str], place: int) -> int | None:
    """Which of the paper's rows of a setting stands beside the value at a place of all values."""
    known = [
        encode_number(text)
        for (table, row, key), text in read_paper().items()
        if (table, key) == ("sensitivity", "value") and row.startswith(f"{setting}.")
    ]
    if set(values) & set(known):
        return known.index(values[place]) if values[place] in known else None
    return place if len(values) == len(known) else None


def tabulate_ablation(sweeps: dict[str, list[dict]], baselines: dict[str, str]) -> list[dict]:
    """A row for each variant of each sweep: means and deviations over seeds as in `sensitivity`, and for each measure
    of TESTED its difference from the sweep's baseline, paired by scene and seed (`statistics.PairedTest`).

    `_holm`: p adjusted for the number of variants of the sweep. Of a sweep over two settings the last value of the
    second one counts.
    """
    found = []
    for name, cells in sweeps.items():
        at = {row["varied_0"]: row.get("varied_1") for row in cells}
        last = [row for row in cells if row.get("varied_1") == at[row["varied_0"]]]
        variants = list(dict.fromkeys(row["varied_0"] for row in last))
        block = [_variant(name, variant, last, baselines[name]) for variant in variants]
        for key in TESTED:
            known = {v: p for v, row in zip(variants, block, strict=True) if (p := row[f"{key}_p"]) is not None}
            adjusted = statistics.adjust_holm(known)
            block = [row | {f"{key}_holm": adjusted.get(v)} for v, row in zip(variants, block, strict=True)]
        printed = ("psnr", "seam_lpips", "memory_gb", "render_ms", "score_s", "p")
        found += [row | find_printed("ablation", v, printed) for v, row in zip(variants, block, strict=True)]
    return found


def _variant(sweep: str, variant: str, cells: list[dict], baseline: str) -> dict:
    mine, base = ([row for row in cells if row["varied_0"] == name] for name in (variant, baseline))
    row = {"sweep": sweep, "variant": variant, "less": baseline, "cells": len(mine)}
    for key in (*ABLATED, "photos"):
        row |= mean_and_deviation(mine, key)
    for key in TESTED:
        row |= {f"{key}_{name}": value for name, value in _compared(key, mine, base, variant == baseline).items()}
    return row


def _compared(key: str, mine: list[dict], base: list[dict], same: bool) -> dict:
    at = {(row["scene"], row["preset"], row["seed"]): row[key] for row in base if row[key] is not None}
    pairs: dict[str, list[float]] = {}
    for row in mine:
        unit = (row["scene"], row["preset"], row["seed"])
        if unit in at and row[key] is not None:
            pairs.setdefault(row["scene"], []).append(row[key] - at[unit])
    if same or not pairs:
        return dict.fromkeys(("units", "difference", "low", "high", "t", "df", "p", "d"))
    test = asdict(statistics.compute_paired_test({scene: np.array(values) for scene, values in pairs.items()}))
    return {"units": test["units"], "difference": test.pop("mean")} | test
