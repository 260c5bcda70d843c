"""Random fields on a square that repeats."""

import numpy as np
import pytest

from dav_gswt.photos.synthetic import noise


def test_a_ripple_has_its_profile(golden):
    phase = np.linspace(-np.pi, np.pi, 2001)
    golden("ripple profile", noise.ripple_profile(phase))


@pytest.mark.parametrize(
    "draw",
    [
        lambda rng: noise.make_noise(rng, 64, 4.0, 1.0, 0.2, 1.0),
        lambda rng: np.stack(noise.make_ripples(rng, 64, 4.0, 0.3, 0.5)),
    ],
)
def test_a_raster_is_the_same_on_any_number_of_threads(monkeypatch, draw):
    found = []
    for threads in ("1", "3"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(draw(np.random.default_rng(3)))
    assert np.array_equal(*found)
