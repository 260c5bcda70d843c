"""Level weights and cross-faded opacities: hand-worked values, the numbers shared with the page."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.terrain.weights import crossfade_opacity, finer_share, level_weights

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "weights.json").read_text())
FAR = np.array([0.0, 1e-9, 5.0, 9.0, 9.5, 10.0, 10.5, 11.0, 20.0, 1e12, np.inf])
bands = st.one_of(st.sampled_from([0.0, 1e-12, 1e6]), st.floats(0.0, 1e6))


@pytest.mark.parametrize("entry", GOLDEN["levels"][::5], ids=lambda e: f"{e['distance']:g}-{e['bands'][0]:g}")
def test_weights_are_those_shared_with_the_page(entry):
    switches = [np.inf if s is None else s for s in entry["switches"]]
    found = level_weights(np.array([entry["distance"]]), switches, entry["bands"], entry["smooth"])[:, 0]
    np.testing.assert_allclose(found, entry["weights"], rtol=0, atol=1e-12)


def test_all_of_the_shared_weights_sum_to_one():
    assert len(GOLDEN["levels"]) > 100
    for entry in GOLDEN["levels"]:
        assert sum(entry["weights"]) == pytest.approx(1, abs=1e-15) and min(entry["weights"]) >= 0


def test_opacities_are_those_shared_with_the_page():
    opacity, weight, drawn = (np.array([e[key] for e in GOLDEN["opacities"]]) for key in ("opacity", "weight", "drawn"))
    np.testing.assert_allclose(crossfade_opacity(opacity, weight), drawn, rtol=1e-12, atol=0)


def test_the_band_is_worked_by_hand():
    distance = np.array([8.0, 9.0, 9.5, 10.0, 10.5, 11.0, 12.0])
    assert finer_share(distance, 10.0, 1.0).tolist() == [1, 1, 0.75, 0.5, 0.25, 0, 0]
    assert finer_share(distance, 10.0, 1.0, True).tolist() == [1, 1, 0.84375, 0.5, 0.15625, 0, 0]


def test_a_band_of_nothing_is_a_step_with_a_half_in_the_middle():
    distance = np.array([0.0, np.nextafter(10, 0), 10.0, np.nextafter(10, 11), np.inf])
    assert finer_share(distance, 10.0, 0.0).tolist() == [1, 1, 0.5, 0, 0]


@pytest.mark.parametrize("band", [0.0, 1e-12, 1e-300, 1e6])
@pytest.mark.parametrize("smooth", [False, True])
def test_the_share_is_finite_and_falls_from_one_to_zero(band, smooth):
    share = finer_share(FAR, 10.0, band, smooth)
    assert np.isfinite(share).all() and (np.diff(share) <= 0).all() and share[-1] == 0
    assert (share[0] == 1) == (band < 10) and share[FAR == 10.0] == 0.5


@given(st.floats(1e-3, 1e6), bands, st.floats(0, 1e7), st.floats(0, 1e7), st.booleans())
def test_a_farther_gaussian_never_has_more_of_the_finer_level(switch, band, a, b, smooth):
    near, far = finer_share(np.array(sorted((a, b))), switch, band, smooth)
    assert 1 >= near >= far >= 0


@given(st.lists(st.tuples(st.floats(1e-3, 1e4), bands), min_size=0, max_size=5), st.floats(0, 1e5), st.booleans())
def test_weights_are_shares_of_one_whatever_the_bands(levels, distance, smooth):
    switches = [*sorted(s for s, _ in levels), np.inf]
    weights = level_weights(np.array([distance]), switches, [*(b for _, b in levels), 0.0], smooth)[:, 0]
    assert (weights >= 0).all() and weights.sum() == pytest.approx(1, abs=1e-14)


def test_levels_follow_one_another():
    weights = level_weights(np.array([0.0, 10.0, 15.0, 20.0, 1e9]), [10.0, 20.0, np.inf], [1.0, 2.0, 0.0])
    assert weights.T.tolist() == [[1, 0, 0], [0.5, 0.5, 0], [0, 1, 0], [0, 0.5, 0.5], [0, 0, 1]]


def test_one_level_alone_is_drawn_whole_everywhere():
    assert level_weights(FAR, [np.inf], [0.0]).tolist() == [[1.0] * len(FAR)]


def test_a_whole_weight_keeps_the_opacity_and_none_takes_it_all():
    opacity = np.array([0.0, 1e-12, 0.5, 1 - 1e-9, 1.0])
    assert crossfade_opacity(opacity, np.ones(5)).tolist() == opacity.tolist()
    assert crossfade_opacity(opacity, np.zeros(5)).tolist() == [0] * 5


def test_two_equal_gaussians_half_drawn_hide_as_much_as_one():
    half = crossfade_opacity(np.array([0.9]), np.array([0.5]))[0]
    assert half == pytest.approx(1 - 0.1**0.5)
    assert 1 - (1 - half) ** 2 == pytest.approx(0.9, abs=1e-15)  # the linear fade's .45 twice hides .70


@given(st.lists(st.floats(0, 0.9999), min_size=1, max_size=6), st.floats(0, 1))
def test_two_identical_levels_look_like_one_at_every_weight(opacities, weight):
    """Composited in the merged order, each splat beside its twin: colour and transmittance are unchanged."""
    opacity = np.array(opacities)
    colours = np.arange(len(opacity)) + 1.0
    fine, coarse = (crossfade_opacity(opacity, np.full(len(opacity), w)) for w in (weight, 1 - weight))
    both, twice = np.stack([fine, coarse], 1).ravel(), np.repeat(colours, 2)
    for alphas, paint in ((opacity, colours), (both, twice)):
        left = np.cumprod(np.concatenate([[1.0], 1 - alphas]))
        seen = (paint * alphas * left[:-1]).sum(), left[-1]
        if alphas is opacity:
            expected = seen
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-12)


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_more_weight_never_hides_less(opacity, a, b):
    less, more = crossfade_opacity(np.full(2, opacity), np.array(sorted((a, b))))
    # at weight 1 an opacity above 1 - 1e-6 is itself, below 1 at most that: a jump upwards too
    assert 0 <= less <= more <= 1
