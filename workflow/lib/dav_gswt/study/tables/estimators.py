"""What stands under the figure of estimators: the Seam-LPIPS of the tiles that come of each."""

from pathlib import Path

from dav_gswt.study import statistics
from dav_gswt.study.seams import summary, tables


def note(crops: Path | str) -> str:
    """Seam-LPIPS of the cuts less their floor, over all views; nothing where LPIPS had no weights. crops: crops.csv."""
    rows = tables.read(crops)
    at = {(row["place"], row["view"], row["ground"], row["crop"]): row for row in rows}
    sums = summary.of_crops(at, "cut")
    if not sums:
        return ""
    value, _, _ = statistics.percentile_interval(statistics.bootstrap_clusters(sums)[0][:, 0])
    return f"\nSeam-LPIPS {value:+.3f}"
