from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.raster import render
from dav_gswt.reconstruction.fitting import sh_degree, state
from dav_gswt.reconstruction.fitting.plan import FitReport


def directed(strength):
    """The made-up field with colours that change with direction."""
    field = made.field()
    sh = np.zeros((len(field), 4, 3), np.float32)
    sh[:, 0] = field.sh[:, 0]
    sh[:, 1:] = np.random.default_rng(0).normal(0, strength, (len(field), 3, 3))
    return state.from_field(replace(field, sh=sh))


def test_a_lower_degree_shows_what_the_photos_see_on_average():
    full, photos = directed(0.2), made.photos()
    cameras = [view.camera for view in photos]
    plain = full.copy()
    plain.resize_sh(0)
    folded = sh_degree.reduce_degree(full, 0, cameras)
    assert folded.sh_degree == 0 and full.sh_degree == 1

    def apart(now):
        pictures = [[render(state.to_field(s, 0), c).colour for s in (now, full)] for c in cameras]
        return np.mean([np.abs(a - b).mean() for a, b in pictures])

    assert apart(folded) < 0.5 * apart(plain)


def test_one_camera_sees_no_difference_at_all():
    full, camera = directed(0.2), made.photos(1)[0].camera
    folded = sh_degree.reduce_degree(full, 0, [camera])
    seen = [render(state.to_field(now, 0), camera).colour for now in (full, folded)]
    np.testing.assert_allclose(*seen, atol=1e-5)


@pytest.mark.parametrize("gain, degree", [(0.01, 0), (1.0, 1)])
def test_the_least_degree_that_loses_little_is_chosen_and_reported(gain, degree):
    full, report = directed(0.2), FitReport()
    found = sh_degree.choose_degree(full, [made.photos(1)[0].camera], lambda now: 30 + gain * now.sh_degree, report)
    assert found.sh_degree == degree
    assert report.choices == [
        {"what": "degree", "value": degree, "why": f"degree 1 is worth {gain:+.3f} dB on held-out pixels"}
    ]
    assert [row["degree"] for row in report.held_out] == [0, 1]
