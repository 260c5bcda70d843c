"""PSNR, colour correction, and HDR pictures that become usual ones."""

import numpy as np
import pytest

from dav_gswt.images import metrics
from dav_gswt.images.srgb import convert_hdr

ONE = np.ones((16, 16), np.float32)


def test_pixels_of_weight_0_do_not_count():
    a = np.full((16, 16, 3), 0.5, np.float32)
    b = a + np.float32(0.1)
    b[:8] = 1
    weight = ONE.copy()
    weight[:8] = 0
    assert metrics.psnr(a, b, weight) == pytest.approx(20, abs=1e-4)  # a uniform error of a tenth; float32's 0.1
    assert metrics.psnr(a, a, ONE) is None
    with pytest.raises(ValueError, match="weight is 0"):
        metrics.psnr(a, b, 0 * ONE)


def test_colour_correction_undoes_a_change_of_exposure():
    rng = np.random.default_rng(0)
    picture = rng.uniform(0.2, 0.6, (16, 16, 3)).astype(np.float32)
    photo = picture * [1.2, 1.0, 0.8] + [0.05, 0, -0.02]
    np.testing.assert_allclose(metrics.correct_colours(picture, photo, ONE), photo, atol=1e-6)


@pytest.mark.parametrize(("curve", "signal"), [("hlg", 0.75), ("pq", 0.58)])
def test_white_is_white_and_black_is_black(curve, signal):
    """BT.2408: HLG shows a white sheet at 75 % of the signal, PQ (203 of 10,000 candela a square metre) at 58 %."""
    values = np.array([[[0.0] * 3, [signal] * 3, [1.0] * 3]])
    black, white, brightest = convert_hdr(np.rint(65535 * values).astype(np.uint16), curve)[0]
    assert (black == 0).all() and (white >= 253).all() and (brightest == 255).all()
