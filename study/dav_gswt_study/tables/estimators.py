"""The note under each picture of the figure of estimators: Seam-LPIPS of the tiles."""

from pathlib import Path

from dav_gswt_study import statistics
from dav_gswt_study.seams import summary, tables


def format_seam_note(crops: Path | str) -> str:
    """Seam-LPIPS of the cuts over their floor, over all views; empty without LPIPS. crops: path of crops.csv."""
    rows = tables.read_seam_table(crops)
    at = {(row["place"], row["view"], row["ground"], row["crop"]): row for row in rows}
    sums = summary.subtract_floors(at, "cut")
    if not sums:
        return ""
    value, _, _ = statistics.percentile_interval(statistics.bootstrap_clusters(sums)[0][:, 0])
    return f"\nSeam-LPIPS {value:+.3f}"
