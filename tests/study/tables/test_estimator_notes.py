"""What stands under the figure of estimators."""

from dav_gswt.study import csv_tables
from dav_gswt.study.seams import measure
from dav_gswt.study.tables import estimators


def crops(path, value, floor):
    at = {"view": "top", "ground": "flat", "psnr": 30.0, "jump": 1.5}
    rows = [
        at | {"place": place, "crop": n, "cluster": str(n), "seam_lpips": lpips}
        for n in range(3)
        for place, lpips in (("cut", value), ("floor", floor))
    ]
    csv_tables.write_table(path, [{key: row[key] for key in measure.COLUMNS} for row in rows])
    return path


def test_seams_are_told_over_their_floor_and_not_without_lpips(tmp_path):
    assert estimators.format_seam_note(crops(tmp_path / "a.csv", 0.3, 0.1)) == "\nSeam-LPIPS +0.200"
    assert estimators.format_seam_note(crops(tmp_path / "b.csv", None, None)) == ""
