import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.paths import read_stop, spell, spell_stop


@pytest.mark.parametrize(
    "value, text",
    [(0.1, "0.1"), ("0.10", "0.1"), (0, "0"), (-0.0, "0"), (1.0, "1"), (20, "20"), (100.0, "100"), (1e-4, "0.0001")],
)
def test_a_number_has_one_spelling(value, text):
    assert spell(value) == text


@pytest.mark.parametrize(
    "stop, text",
    [
        ({}, ""),
        ({"photos": 20}, "_upto20"),
        ({"worth": 0.05}, "_worth0.05"),
        ({"worth": 1.0, "photos": 100}, "_upto100_worth1"),
    ],
)
def test_a_stop_has_one_spelling(stop, text):
    assert spell_stop(stop) == text and read_stop(text) == stop


@given(st.integers(3, 100_000), st.decimals(min_value="0.0001", max_value=100, places=6))
def test_what_is_spelled_is_read_back(photos, worth):
    for stop in ({"photos": photos}, {"worth": float(worth)}, {"photos": photos, "worth": float(worth)}):
        assert read_stop(spell_stop(stop)) == stop


@pytest.mark.parametrize(
    "text", ["_upto020", "_upto5.0", "_worth0.50", "_worth", "_worth1_upto5", "upto5", "_upto5_", "_upto5_upto6", "_x"]
)
def test_another_spelling_is_refused(text):
    with pytest.raises(ValueError, match="does not say when rounds stop|invalid literal"):
        read_stop(text)
