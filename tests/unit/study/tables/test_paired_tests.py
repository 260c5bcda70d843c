"""Paired tests: the usual one of one scene, degrees of freedom of several, a slow twin, what cannot be told."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from dav_gswt.study.tables.paired import paired

VALUES = some.lists(some.floats(-5, 5), min_size=3, max_size=6).filter(lambda v: np.std(v) > 1e-3)


@settings(max_examples=15)  # each draws a bootstrap
@given(values=VALUES)
def test_one_scene_is_the_usual_paired_test(values):
    found, usual = paired({"a": np.array(values)}), stats.ttest_1samp(values, 0.0)
    assert found.df == len(values) - 1 and found.units == len(values)
    assert found.t == pytest.approx(float(usual.statistic)) and found.p == pytest.approx(float(usual.pvalue))
    assert found.d == pytest.approx(np.mean(values) / np.std(values, ddof=1))


def test_scenes_far_apart_do_not_count_as_spread_of_seeds():
    """A slow twin: least squares of the differences on one mean a scene, and the variance of the means' mean."""
    a, b = np.array([1.0, 1.2, 0.9]), np.array([5.0, 5.3])
    found = paired({"a": a, "b": b})
    design = np.array([[1, 0]] * 3 + [[0, 1]] * 2, float)
    means, squares, *_ = np.linalg.lstsq(design, np.concatenate([a, b]), rcond=None)
    covariance = squares[0] / 3 * np.linalg.inv(design.T @ design)
    half = np.array([0.5, 0.5])
    assert (found.df, found.units) == (3, 5)
    assert found.t == pytest.approx(float(half @ means / np.sqrt(half @ covariance @ half)))
    assert found.mean == pytest.approx(float(half @ means)) and found.low < found.mean < found.high


def test_what_cannot_be_told_is_not():
    one = paired({"a": np.array([0.5])})
    assert (one.units, one.mean, one.low, one.t, one.df, one.p) == (1, 0.5, None, None, 0, None)
    each = paired({"a": np.array([0.5]), "b": np.array([0.7])})
    assert each.t is None and each.df == 0 and each.low < each.mean < each.high
    alike = paired({"a": np.array([0.5, 0.5])})
    assert (alike.t, alike.d, alike.df) == (None, None, 1)


def test_no_pair_is_an_error():
    with pytest.raises(ValueError, match="needs differences"):
        paired({})
