"""HDR pictures become usual ones."""

import numpy as np
import pytest

from dav_gswt.images.hdr import convert_hdr


@pytest.mark.parametrize(("curve", "signal"), [("hlg", 0.75), ("pq", 0.58)])
def test_white_is_white_and_black_is_black(curve, signal):
    """BT.2408: HLG shows a white sheet at 75 % of the signal, PQ (203 of 10,000 candela a square metre) at 58 %."""
    values = np.array([[[0.0] * 3, [signal] * 3, [1.0] * 3]])
    black, white, brightest = convert_hdr(np.rint(65535 * values).astype(np.uint16), curve)[0]
    assert (black == 0).all() and (white >= 253).all() and (brightest == 255).all()
