"""Sizes of Gaussians: clipped, no needles, axis by axis as a plain loop has them."""

import numpy as np
import pytest

from dav_gswt.reconstruction.fitting.constraints import FLAT, NEEDLE, clip_sizes

LEAST, MOST = 0.01, 10.0


def clip_plainly(row):
    """The sizes of one Gaussian, each step in float32."""
    row = [np.float32(min(max(v, np.float32(np.log(LEAST))), np.float32(np.log(MOST)))) for v in row]
    longest = max(row)
    row = [max(v, np.float32(longest - FLAT)) for v in row]
    middle = sorted(range(3), key=lambda k: row[k])[1]
    row[middle] = max(row[middle], np.float32(longest - NEEDLE))
    return row


@pytest.mark.parametrize("equal", [(), (0, 1), (1, 2), (0, 2), (0, 1, 2)])
def test_sizes_are_those_of_a_plain_loop(equal):
    sizes = np.random.default_rng(0).normal(0, 3, (400, 3)).astype(np.float32)
    sizes[:, equal] = sizes[:, equal[:1]]
    expected = np.array([clip_plainly(row) for row in sizes], np.float32)
    clip_sizes(sizes, LEAST, MOST)
    np.testing.assert_array_equal(sizes, expected)


def test_a_needle_becomes_as_thick_as_is_allowed():
    sizes = np.log(np.array([[1.0, 0.02, 0.02], [1.0, 0.5, 0.01]], np.float32))
    clip_sizes(sizes, LEAST, MOST)
    np.testing.assert_allclose(np.sort(np.exp(sizes), 1), [[0.1, 1 / 3, 1], [0.1, 0.5, 1]], rtol=1e-6)


def test_no_gaussians_have_no_sizes():
    clip_sizes(np.zeros((0, 3), np.float32), LEAST, MOST)
