"""Means and deviations of a sweep's rows over scenes and seeds, joined with the viewer's measurements."""

from pathlib import Path

import pandas as pd

from dav_gswt_study import csv_tables, sweeps

VIEWER = (
    *("render_ms", "render_ms_sd", "sort_ms", "sort_ms_sd", "sort_share"),
    *("update_ms", "update_ms_sd", "update_share"),
)
CELL = ("scene", "seed", "preset", "tiling", "tau")  # key of the viewer's measurements


def mean_and_deviation(rows: list[dict], key: str) -> dict[str, float | None]:
    """The mean under the key, and under key_sd the standard deviation over seeds, as the paper's.

    The mean is over scenes of the means over their seeds: scenes with more seeds do not count more. The deviation is of
    the means over scenes; None of fewer than two seeds that all scenes have.
    """
    known = [(row["scene"], str(row["seed"]), row[key]) for row in rows if row.get(key) is not None]
    if not known:
        return {key: None, f"{key}_sd": None}
    table = pd.DataFrame(known, columns=["scene", "seed", key]).pivot_table(key, "seed", "scene")
    whole = table.dropna().mean(axis=1)
    return {key: float(table.mean().mean()), f"{key}_sd": float(whole.std()) if len(whole) > 1 else None}


def read_sweep(path: Path | str, viewer: Path | str | None) -> list[dict]:
    """The rows of a sweep's table, with what the viewer measured of their bundle: VIEWER, None where nothing."""
    at = {tuple(str(row[key]) for key in CELL): {key: row[key] for key in VIEWER} for row in read_viewer(viewer)}
    rows = sweeps.read_sweep(path)
    return [row | at.get(tuple(str(row[key]) for key in CELL), dict.fromkeys(VIEWER)) for row in rows]


def read_viewer(path: Path | str | None) -> list[dict]:
    """A table with the columns CELL and some of VIEWER (milliseconds a frame; shares of frames, 0 to 1, in which the
    worker ran); no rows where there is no such file."""
    rows = csv_tables.read_table(path, numbers=VIEWER, missing_ok=True) if path else []
    return [dict.fromkeys(VIEWER) | row for row in rows]
