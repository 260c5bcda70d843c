"""Means and deviations of a sweep's rows over scenes and seeds, joined with the viewer's measurements."""

from pathlib import Path

import numpy as np

from dav_gswt import csv_tables
from dav_gswt_study.sweeps import tables as sweep

VIEWER = (
    *("render_ms", "render_ms_sd", "sort_ms", "sort_ms_sd", "sort_share"),
    *("update_ms", "update_ms_sd", "update_share"),
)
CELL = ("scene", "seed", "preset", "tiling", "tau")  # key of the viewer's measurements


def compute_mean(rows: list[dict], key: str) -> float | None:
    """Mean over scenes of the means over their seeds: scenes with more seeds do not count more."""
    by_scene: dict[str, list[float]] = {}
    for row in rows:
        if row.get(key) is not None:
            by_scene.setdefault(row["scene"], []).append(row[key])
    return float(np.mean([np.mean(values) for values in by_scene.values()])) if by_scene else None


def compute_deviation(rows: list[dict], key: str) -> float | None:
    """The standard deviation (ddof 1) over seeds of the mean over scenes, as the paper's; None of fewer than two seeds
    that all scenes have."""
    scenes = {row["scene"] for row in rows if row.get(key) is not None}
    by_seed: dict[str, dict[str, float]] = {}
    for row in rows:
        if row.get(key) is not None:
            by_seed.setdefault(str(row["seed"]), {})[row["scene"]] = row[key]
    whole = [np.mean(list(values.values())) for values in by_seed.values() if set(values) == scenes]
    return float(np.std(whole, ddof=1)) if len(whole) > 1 else None


def mean_and_deviation(rows: list[dict], key: str) -> dict[str, float | None]:
    """`mean` under the key, `deviation` under key_sd."""
    return {key: compute_mean(rows, key), f"{key}_sd": compute_deviation(rows, key)}


def join_viewer(rows: list[dict], viewer: list[dict]) -> list[dict]:
    """The rows with what the viewer measured of their bundle, None where nothing. viewer: see `read_viewer`."""
    at = {tuple(str(row[key]) for key in CELL): row for row in viewer}
    found = [at.get(tuple(str(row[key]) for key in CELL), {}) for row in rows]
    return [row | {key: seen.get(key) for key in VIEWER} for row, seen in zip(rows, found, strict=True)]


def read_sweeps(paths: list[Path | str], viewer: Path | str | None) -> list[list[dict]]:
    """The rows of each sweep's table, with what the viewer measured of their bundles."""
    measured = read_viewer(viewer)
    return [join_viewer(sweep.read_sweep(path), measured) for path in paths]


def read_viewer(path: Path | str | None) -> list[dict]:
    """A table with the columns CELL and some of VIEWER (milliseconds a frame; shares of frames, 0 to 1, in which the
    worker ran); no rows where there is no such file."""
    rows = csv_tables.read_table(path, numbers=VIEWER, missing_ok=True) if path else []
    return [dict.fromkeys(VIEWER) | row for row in rows]
