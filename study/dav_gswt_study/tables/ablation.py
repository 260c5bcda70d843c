"""The paper's table of ablation: estimators, policies and tilings, each minus the baseline of its sweep."""

from dataclasses import asdict

import numpy as np

from dav_gswt_study import statistics
from dav_gswt_study.tables import paper, spread

QUALITY = ("psnr", "lpips", "seam_lpips", "seam_psnr", "seam_density")
MEANS = (*QUALITY, "peak_mb", "render_ms", "score_s", "recon_s", "photos")
COMPARED = ("psnr", "seam_lpips")  # measures that are tested
PRINTED = ("psnr", "seam_lpips", "memory_gb", "render_ms", "score_s", "p")


def tabulate_ablation(sweeps: dict[str, list[dict]], baselines: dict[str, str]) -> list[dict]:
    """A row for each variant of each sweep: means and deviations over seeds as in `sensitivity`, and for each measure
    of COMPARED its difference from the sweep's baseline, paired by scene and seed (`statistics.PairedTest`).

    `_holm`: p adjusted for the number of variants of the sweep. Of a sweep over two settings the last value of the
    second one counts.
    """
    found = []
    for name, cells in sweeps.items():
        last = _last(cells)
        variants = list(dict.fromkeys(row["varied_0"] for row in last))
        block = [_variant(name, variant, last, baselines[name]) for variant in variants]
        for key in COMPARED:
            known = {v: p for v, row in zip(variants, block, strict=True) if (p := row[f"{key}_p"]) is not None}
            adjusted = statistics.adjust_holm(known)
            block = [row | {f"{key}_holm": adjusted.get(v)} for v, row in zip(variants, block, strict=True)]
        found += [row | paper.find_printed("ablation", v, PRINTED) for v, row in zip(variants, block, strict=True)]
    return found


def _last(cells: list[dict]) -> list[dict]:
    """The experiments of each variant with the last value of the second setting."""
    at = {row["varied_0"]: row.get("varied_1") for row in cells}
    return [row for row in cells if row.get("varied_1") == at[row["varied_0"]]]


def _variant(sweep: str, variant: str, cells: list[dict], baseline: str) -> dict:
    mine, base = ([row for row in cells if row["varied_0"] == name] for name in (variant, baseline))
    row = {"sweep": sweep, "variant": variant, "less": baseline, "cells": len(mine)}
    for key in MEANS:
        row |= spread.mean_and_deviation(mine, key)
    for key in COMPARED:
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
