"""Curves of policies: a table with a row per round of each cell.

A cell is a scene, a seed (of the start photos), a policy with its parameters, and k.
"""

import csv
from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.study import csv_tables
from dav_gswt.views import stopping

CELL = ("scene", "seed", "preset", "policy", "prior", "p_drop", "lam", "k")
MEASURES = ("psnr", "ssim", "lpips", "worst_psnr", "walker_psnr")
ASIDE = ("oblique", "walker")  # groups of test views away from where photos may be taken
EXPECTED = ("closes", "expected", "expected_low", "expected_high")  # predicted before a round: `marginal_gain`


def read_cell(cell: dict) -> list[dict]:
    """The rows of a cell, the start first.

    cell: what CELL names; `corrected`: PSNR after the photos' exposure is fitted; files: `metrics` of each round, the
    start's first; `facts`, scores.json of what rounds 1 to T chose by; `times`, for each of these rounds its jobs'
    benchmarks; `samples` that the prior draws of a pose.
    """
    found, fits = [], []
    for t, path in enumerate(cell["metrics"]):
        metrics = read_json(path)
        row = {key: cell[key] for key in CELL} | {"round": t, "photos": metrics["photos"]}
        row |= select_metrics(metrics, "psnr_colour_corrected" if cell["corrected"] else "psnr")
        row |= _predict_gain(found, fits, metrics["photos"])
        if t:
            fits.append(metrics["fit"])
        row |= {"seconds": _sum_seconds(cell["times"][t - 1]) if t else 0.0}
        row |= {"evaluations": _count_evaluations(cell["facts"][t - 1], cell["samples"]) if t else 0}
        provenance = metrics["provenance"]
        renderer = " ".join(str(value) for value in provenance["renderer"].values())
        found.append(
            row | {"version": provenance["version"], "renderer": renderer, "field": provenance["inputs"]["field"][:12]}
        )
    return found


def read_curves(path: Path | str) -> list[dict]:
    """Read the table of curves."""
    integers = ("seed", "k", "round", "photos", "evaluations")
    return csv_tables.read_table(path, numbers=(*MEASURES, *EXPECTED, "seconds"), integers=integers)


def select_metrics(metrics: dict, psnr: str) -> dict:
    """MEASURES of a metrics.json, PSNR by its key: over the test views from where photos may be taken, if they are a
    group of their own, else over all."""
    groups = metrics["groups"]
    mine = next((groups[name] for name in groups if name not in ASIDE), metrics)
    found = {"psnr": mine[psnr], "ssim": mine["ssim"], "lpips": mine["lpips"]}
    found |= {"worst_psnr": mine["worst_decile"][psnr]}
    return found | {"walker_psnr": groups["walker"][psnr] if "walker" in groups else None}


def _predict_gain(before: list[dict], fits: list[dict], photos: int) -> dict:
    """Predict a round's gain from the rounds before it. before: their rows; fits: their reports."""
    if not before:
        return dict.fromkeys(EXPECTED)
    history = stopping.build_history(fits, before[0]["photos"])
    found = stopping.predict_gain(*history, photos - before[-1]["photos"])
    values = (found.closes, found.gain, found.low, found.high) if found else (None,) * len(EXPECTED)
    return dict(zip(EXPECTED, values, strict=True))


def _sum_seconds(files: list[str]) -> float | None:
    """Of a round's jobs together; None where one left no benchmark."""
    if not all(Path(file).is_file() for file in files):
        return None
    total = 0.0
    for file in files:
        with Path(file).open(newline="", encoding="utf-8") as text:
            total += float(next(csv.DictReader(text, delimiter="\t"))["s"])
    return total


def _count_evaluations(facts: str, samples: int) -> int:
    """Forward passes of the prior's network, for one pose each."""
    by_steps = read_json(facts)["poses_by_steps"]
    return samples * sum(int(steps) * poses for steps, poses in by_steps.items())
