"""HDR pictures become usual ones."""

import numpy as np
import pytest

from dav_gswt.images.srgb import convert_hdr


@pytest.mark.parametrize(("curve", "signal"), [("hlg", 0.75), ("pq", 0.58)])
def test_white_is_white_and_black_is_black(curve, signal):
    """BT.2408: HLG shows a white sheet at 75 % of the signal, PQ (203 of 10,000 candela a square metre) at 58 %."""
    values = np.array([[[0.0] * 3, [signal] * 3, [1.0] * 3]])
    black, white, brightest = convert_hdr(np.rint(65535 * values).astype(np.uint16), curve)[0]
    assert (black == 0).all() and (white >= 253).all() and (brightest == 255).all()


def test_half_of_hlg_is_a_third_of_white():
    """(1/2)^2 / 3 of the brightest, over .265: .314 of white, which sRGB codes as .598."""
    grey = convert_hdr(np.full((1, 1, 3), 32768, np.uint16), "hlg")[0, 0]
    assert grey == pytest.approx(255 * 0.598, abs=1)


def test_wide_colours_gain_saturation():
    """BT.2020's primaries lie farther out: the same numbers mean a stronger red."""
    red, green, _ = convert_hdr(np.array([[[40000, 30000, 30000]]], np.uint16), "hlg")[0, 0].astype(int)
    plain = [convert_hdr(np.full((1, 1, 3), v, np.uint16), "hlg")[0, 0, 0].astype(int) for v in (40000, 30000)]
    assert red - green > plain[0] - plain[1]
