"""Random fields on a square that repeats."""

import numpy as np
import pytest

from dav_gswt.photos.synthetic import noise


@pytest.mark.parametrize("wind", [0.5, 2.0])
def test_ripples_have_their_length_along_the_wind_and_grow_in_phase_with_it(wind):
    n, period, length = 256, 8.0, 0.4
    phase, strength = noise.make_ripples(np.random.default_rng(2), n, period, length, wind)
    step = np.angle(np.exp(1j * np.diff(phase, axis=1)[:-1])), np.angle(np.exp(1j * np.diff(phase, axis=0)[:, :-1]))
    where = strength[:-1, :-1] > 0.5  # away from forks, where a phase has no slope
    slope = np.array([s[where].mean() for s in step]) * n / period
    expected = 2 * np.pi / length * np.array([np.cos(wind), np.sin(wind)])
    # the lobe is 11 to 17 % wide, over ~400 ripples
    assert slope == pytest.approx(expected, abs=0.1 * 2 * np.pi / length)
    assert strength.min() >= 0 and strength.max() <= 1


def test_a_ripple_has_its_profile(golden):
    phase = np.linspace(-np.pi, np.pi, 2001)
    golden("ripple profile", noise.ripple_profile(phase))


def test_a_raster_is_sampled_at_texel_centres_between_them_and_across_its_edge():
    raster = np.array([[0.0, 1.0], [2.0, 3.0]])  # texels of side 1, centres at .5 and 1.5
    x = np.array([0.5, 1.5, 0.5, 1.0, 2.0, -1.5, 2.5])
    y = np.array([0.5, 0.5, 1.5, 1.0, 0.5, 0.5, 4.5])
    assert noise.sample_raster(raster, 2.0, x, y) == pytest.approx(np.array([0, 1, 2, 1.5, 0.5, 0, 0]))


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
