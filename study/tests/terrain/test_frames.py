import numpy as np
import pytest

from dav_gswt_study.terrain import frames

ASKED = frames.FrameSettings(
    {"kind": "hills", "height": 1, "wavelength": 10}, {"frames": 3, "length": 1, "height": 1}, 48, 32, [900, 300]
)


def row_of(**times) -> dict:
    parts = {"render": [3.0, 5.0, 4.0], "sort": [1.0, 2.0], "update": [2.0, 2.0], "counts": [899, 900, 901], "ran": 2}
    return frames._tabulate_times(ASKED, 900, parts | times)


def test_a_row_holds_means_deviations_and_shares_worked_by_hand():
    row = row_of()
    assert (row["splats"], row["render_ms"], row["sort_ms"], row["update_ms"]) == (900, 4, 1.5, 2)
    np.testing.assert_allclose([row["render_ms_sd"], row["sort_ms_sd"], row["update_ms_sd"]], [1, 0.5**0.5, 0])
    assert row["sort_share"] == row["update_share"] == pytest.approx(2 / 3)
    never = row_of(sort=[])
    assert never["sort_ms"] is never["sort_ms_sd"] is None
