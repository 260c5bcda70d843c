"""Metrics of a field over a made-up ground, and what one photo shows unlike all others."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made
from fixtures import ground as patch
from fixtures import lpips_arrays

from dav_gswt.raster import backends
from dav_gswt.reconstruction import evaluation, observation, photo_colours


def evaluate(views, groups=None, weights=None):
    return evaluation.evaluate_field(patch.field(), views, groups, weights)


def test_a_field_that_is_right_has_no_psnr_and_full_marks():
    found = evaluate(patch.photos(), weights=lpips_arrays.random())
    assert found["psnr"] is None  # equal pictures
    assert found["ssim"] == pytest.approx(1) and found["lpips"] == 0
    assert [row["view"] for row in found["test_views"]] == ["photo_0", "photo_1", "photo_2"]


def off(amount):
    """Photos that differ from the field by noise of a deviation each."""
    rng, photos = np.random.default_rng(0), patch.photos(len(amount), size=64)
    for view, deviation in zip(photos, amount, strict=True):
        view.image[:] = np.clip(view.image + deviation * rng.normal(size=view.image.shape), 0, 1)
    return photos


def test_means_groups_and_the_worst_tenth():
    tests = off([0.02, 0.02, 0.1])
    groups = {"high": ["photo_0", "photo_1"], "low": ["photo_2"], "none": ["elsewhere"]}
    found = evaluate(tests, groups, lpips_arrays.random())
    rows = found["test_views"]
    for key in evaluation.MEASURES:
        values = [row[key] for row in rows]
        assert found[key] == pytest.approx(np.mean(values)) and found["worst_decile"][key] == pytest.approx(values[2])
        assert found["groups"]["low"][key] == values[2] and found["groups"]["none"][key] is None
        assert found["groups"]["high"][key] == pytest.approx(np.mean(values[:2]))
    assert rows[0]["psnr"] == pytest.approx(-20 * np.log10(0.02), abs=1.5) and rows[2]["lpips"] > rows[0]["lpips"]


def test_pixels_that_do_not_count_change_nothing_and_exposure_is_forgiven_where_it_is_said():
    (view,) = off([0.05])
    dim = evaluate([replace(view, image=0.5 * view.image)])
    assert dim["psnr_colour_corrected"] > dim["psnr"] + 5
    weight = view.weight.copy()
    weight[:, 32:] = 0
    spoilt = view.image.copy()
    spoilt[:, 33:] = 1
    one, two = (evaluate([replace(view, image=image, weight=weight)]) for image in (view.image, spoilt))
    assert one["psnr"] == pytest.approx(two["psnr"]) and one["psnr_colour_corrected"] == two["psnr_colour_corrected"]
    assert evaluate([replace(view, weight=np.zeros_like(weight))])["psnr"] is None


def test_without_weights_lpips_is_null_which_is_said_and_so_is_all_without_test_views(caplog):
    with caplog.at_level(logging.INFO):
        found = evaluate(off([0.02]))
    assert found["lpips"] is found["worst_decile"]["lpips"] is None
    none = evaluate([])
    assert none["psnr"] is none["worst_decile"]["ssim"] is None and none["test_views"] == []


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
