"""Areas under curves, and photos to reach a share of the best PSNR."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.study.comparison import stats


def curve(*values):
    return np.array(values, float)


def test_the_area_of_a_line_is_its_middle():
    assert stats.nauc(curve(8, 12, 20), curve(20, 24, 32)) == pytest.approx(26)
    assert stats.nauc(curve(8, 16), curve(30, 30)) == 30


@given(rise=st.floats(-50, 50), stretch=st.integers(1, 20), move=st.integers(0, 100))
def test_the_area_moves_with_the_curve_and_not_with_the_count(rise, stretch, move):
    photos, psnr = curve(8, 10, 17), curve(21, 25, 26)
    area = stats.nauc(photos, psnr)
    assert stats.nauc(move + stretch * photos, psnr + rise) == pytest.approx(area + rise)


@pytest.mark.parametrize(
    ("photos", "psnr"), [((8,), (20,)), ((8, 8), (20, 21)), ((8, 7), (20, 21)), ((8, 9), (20, np.nan))]
)
def test_what_is_no_curve_is_refused(photos, psnr):
    with pytest.raises(ValueError, match="a curve"):
        stats.nauc(curve(*photos), curve(*psnr))


def test_photos_to_reach_lie_between_rounds():
    photos, psnr = curve(8, 12, 16), curve(20, 24, 28)
    assert stats.photos_to_reach(photos, psnr, best=30.0, way=0.6) == pytest.approx(14)  # 26 dB
    assert stats.photos_to_reach(photos, psnr, best=40.0, way=0.95) is None
    assert stats.photos_to_reach(photos, psnr, best=20.0) == 8
