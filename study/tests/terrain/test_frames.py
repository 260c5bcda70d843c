import numpy as np
import pytest
from fixtures import terrains

from dav_gswt_study.terrain import frames

ASKED = frames.FrameSettings(
    {"kind": "hills", "height": 1, "wavelength": 10}, {"frames": 3, "length": 1, "height": 1}, 48, 32, [900, 300]
)


def test_a_frame_is_coarser_within_a_budget():
    terrain = terrains.two_level_terrain()
    camera, manifest = terrains.walking(terrain), terrains.manifest_of(1.0, terrains.MAGENTA)
    times, whole = frames.time_frame(terrain, camera, manifest, 10**6)
    assert set(times) == set(frames.PARTS) and min(times.values()) > 0
    budget = 3 * whole // 4  # the coarsest level alone has half
    assert whole // 2 < frames.time_frame(terrain, camera, manifest, budget)[1] <= budget
    assert frames.coarsen_to_budget(terrain, camera, 10**6) is terrain


def row_of(renderer: str, budget: int, **times) -> dict:
    parts = {"render": [3.0, 5.0, 4.0], "sort": [1.0, 2.0], "update": [2.0, 2.0]} | times
    made = frames._tabulate_times(ASKED, budget, parts, [budget - 1, budget, budget + 1], ran=2)
    return made | frames._describe_renderer(renderer, "SwiftShader" if renderer == frames.PAGE else "")


def test_a_row_holds_means_deviations_and_shares_worked_by_hand():
    row = row_of(frames.PAGE, 900)
    assert (row["splats"], row["render_ms"], row["sort_ms"], row["update_ms"]) == (900, 4, 1.5, 2)
    np.testing.assert_allclose([row["render_ms_sd"], row["sort_ms_sd"], row["update_ms_sd"]], [1, 0.5**0.5, 0])
    assert row["sort_share"] == row["update_share"] == pytest.approx(2 / 3)
    never = row_of(frames.PAGE, 900, sort=[])
    assert never["sort_ms"] is never["sort_ms_sd"] is None
