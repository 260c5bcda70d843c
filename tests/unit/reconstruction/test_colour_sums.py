"""Sums of photos' colours by the core are those by NumPy."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.raster import backends
from dav_gswt.reconstruction import colour_sums

needs_core = pytest.mark.skipif(bool(backends.explain_unavailable("cpu")), reason="the core was not built")


@pytest.fixture(scope="module")
def views():
    """Photos of which one leaves pixels out."""
    photos = made.photos(4, size=64)
    weight = np.ones((64, 64), np.float32)
    weight[20:40, 30:] = 0
    return [replace(photos[0], weight=weight), *photos[1:]]


@pytest.fixture(scope="module")
def places():
    """On the ground, beyond it, and behind the cameras."""
    rng = np.random.default_rng(0)
    near = rng.uniform(-1, 4, (2000, 3)) * [1, 1, 0.1]
    return np.concatenate([near, [[1.6, 1.6, 4.0], [1.6, 1.6, 50.0], [1e6, 0, 0]]]).astype(np.float32)


HEIGHTS = np.array([-0.1, 0, 0.3, 5.0], np.float32)


def by_numpy(monkeypatch, *inputs):
    with monkeypatch.context() as patch:
        patch.setattr(colour_sums.backends, "explain_unavailable", lambda name: "not built")
        return colour_sums.sum_colours(*inputs)


@needs_core
def test_the_core_and_numpy_agree(monkeypatch, views, places):
    wanted, found = by_numpy(monkeypatch, views, places, HEIGHTS), colour_sums.sum_colours(views, places, HEIGHTS)
    assert wanted.count.max() == 4 and (wanted.count == 0).any()
    differ = found.count != wanted.count  # on the border of a pixel or a picture roundings decide
    assert differ.mean() < 1e-3
    np.testing.assert_allclose(found.total[~differ], wanted.total[~differ], atol=1e-5)
    np.testing.assert_allclose(found.squares[~differ], wanted.squares[~differ], atol=1e-5)


@needs_core
def test_the_number_of_threads_changes_no_bit(monkeypatch, views, places):
    many = np.tile(places, (20, 1))
    found = []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(colour_sums.sum_colours(views, many, HEIGHTS))
    np.testing.assert_array_equal(found[0].total, found[1].total)


def test_deviations_are_those_of_the_colours():
    rng = np.random.default_rng(1)
    colours = rng.uniform(0, 1, (5, 1, 7, 3)).astype(np.float32)
    sums = colour_sums.ColourSums(colours.sum(0), (colours**2).sum((0, 3)), np.full((1, 7), 5, np.float32))
    wanted = np.sqrt(colours.astype(float).var(0, ddof=1).sum(-1))
    np.testing.assert_allclose(sums.deviations(), wanted, atol=1e-4)


@needs_core
def test_arrays_of_another_layout_are_refused(views, places):
    cpu = backends.load_backend("cpu")
    view = views[0]
    sums = np.zeros((3, 5, 1), np.float32).T, np.zeros((1, 5), np.float32), np.zeros((1, 5), np.float32)
    with pytest.raises(ValueError, match="sums 0 must be C-contiguous"):
        cpu.add_colours(view.image, view.weight, view.camera, places[:5], HEIGHTS[:1], sums)
