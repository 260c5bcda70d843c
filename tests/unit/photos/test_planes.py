"""A robust plane through points."""

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.blas_threads import print_with_threads

from dav_gswt.errors import InputError
from dav_gswt.photos.planes import fit_plane


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_the_plane_through_points_on_a_plane_by_hand(rng):
    points = np.c_[rng.uniform(-1, 1, (50, 2)), np.full(50, 3.0)]
    normal, offset, spread = fit_plane(points, rng)
    assert np.abs(normal) == pytest.approx([0, 0, 1], abs=1e-9)
    assert offset * normal[2] == pytest.approx(3, abs=1e-9) and spread < 1e-9


def test_four_in_ten_points_above_the_ground_do_not_tilt_the_plane(rng):
    points = synth.plain(1000, 1.0, rng, relief=0.005)
    points[:400, 2] += rng.uniform(0.05, 0.8, 400) * (points[:400, 0] + 1)  # trees, on one side more than on the other
    normal, offset, spread = fit_plane(points, rng)
    # An unweighted fit tilts by 0.1. Here 600 normal heights of 0.005 fix the tilt to about 0.005 / sqrt(600 / 3),
    # and the lowest of the trees, which nothing tells from ground, add their share.
    assert np.hypot(*normal[:2]) < 0.005 and abs(offset) < 0.003
    assert 0.004 < spread < 0.012


def test_the_plane_moves_with_the_points(rng):
    points = synth.plain(300, 1.0, rng, relief=0.02)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    here = fit_plane(points, np.random.default_rng(1))
    there = fit_plane(4 * points @ turn.T + [1e3, 2e3, -5e2], np.random.default_rng(1))
    sign = np.sign((turn @ here[0]) @ there[0])
    assert there[0] == pytest.approx(sign * turn @ here[0], abs=1e-6)
    assert there[2] == pytest.approx(4 * here[2], rel=1e-6)


@pytest.mark.parametrize("points", [np.zeros((2, 3)), np.outer(np.arange(9.0), [1, 2, 3])], ids=["two", "a line"])
def test_points_that_fix_no_plane_are_refused(points, rng):
    with pytest.raises(InputError, match="points"):
        fit_plane(points, rng)


def test_the_plane_has_the_same_bits_whatever_the_threads_of_blas(root):
    code = """if True:
        import numpy as np
        from dav_gswt.photos.planes import fit_plane
        points = np.random.default_rng(1).normal(size=(200_003, 3)) * [1, 1, 0.01]
        normal, offset, spread = fit_plane(points, np.random.default_rng(0))
        print(*(value.hex() for value in (*normal.tolist(), offset, spread)))
    """
    found = print_with_threads(root, code)
    assert len(found[0].split()) == 5 and len(set(found)) == 1
