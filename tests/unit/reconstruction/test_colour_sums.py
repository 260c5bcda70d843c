"""Sums of photos' colours, and what one photo shows unlike all others."""

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.raster import backends
from dav_gswt.reconstruction import observation, photo_colours

needs_core = pytest.mark.skipif(bool(backends.explain_unavailable("cpu")), reason="the core was not built")


@needs_core
def test_the_core_and_numpy_agree_the_number_of_threads_changes_no_bit_and_other_layouts_are_refused(monkeypatch):
    """Of places on the ground, beyond it and behind the cameras, in photos of which one leaves pixels out."""
    near = np.random.default_rng(0).uniform(-1, 4, (500, 3)) * [1, 1, 0.1]
    places = np.concatenate([near, [[1.6, 1.6, 4.0], [1.6, 1.6, 50.0], [1e6, 0, 0]]]).astype(np.float32)
    views, heights = made.photos(4, size=64), np.array([-0.1, 0, 0.3, 5.0], np.float32)
    views[0].weight[20:40, 30:] = 0
    found, cpu = photo_colours.sum_colours(views, places, heights), backends.load_backend("cpu")
    monkeypatch.setattr(cpu, "MIN_PARALLEL", 0)  # small work too is shared out
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        np.testing.assert_array_equal(photo_colours.sum_colours(views, places, heights).total, found.total)
    monkeypatch.setattr(photo_colours.backends, "explain_unavailable", lambda name: "not built")
    wanted = photo_colours.sum_colours(views, places, heights)
    assert wanted.count.max() == 4 and (wanted.count == 0).any()
    differ = found.count != wanted.count  # on the border of a pixel or a picture roundings decide
    assert differ.mean() < 2e-3
    np.testing.assert_allclose(found.total[~differ], wanted.total[~differ], atol=1e-5)
    np.testing.assert_allclose(found.squares[~differ], wanted.squares[~differ], atol=1e-5)


def test_a_line_that_one_photo_shows_does_not_count_and_nothing_else_is_lost():
    grid = made.grid(0.04)
    photos = made.photos(5, size=64)
    photos[2].image[30:33, 10:54] = [1.0, 0.4, 0.0]
    found = observation.mask_distractors(photos, grid.centres, grid.spacing)
    lost = found[2].weight == 0
    assert lost[30:33, 14:50].mean() > 0.9
    lost[28:35] = False
    assert not lost.any()
    assert all(view.weight.all() for i, view in enumerate(found) if i != 2)


@pytest.mark.parametrize("side", [40, 80])
def test_a_shadow_over_much_of_a_photo_does_not_count(side, caplog):
    grid = made.grid(0.1)
    photos = made.photos(5, size=128)
    photos[2].image[24 : 24 + side, 24 : 24 + side] *= 0.4
    lost = observation.mask_distractors(photos, grid.centres, grid.spacing)[2].weight == 0
    assert lost[28 : 20 + side, 28 : 20 + side].mean() > 0.9
    assert ("which do not count" in caplog.text) == (side == 80)


def test_where_all_photos_differ_or_only_three_see_a_place_none_is_at_fault():
    seen = np.random.default_rng(0).uniform(0, 1, (6, 500, 3)).astype(np.float32)
    assert observation.find_disagreeing(seen).mean() < 0.01
    three = np.full((3, 10, 3), 0.5, np.float32)
    three[0] = 1.0
    assert not observation.find_disagreeing(three).any()
