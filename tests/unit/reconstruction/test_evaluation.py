"""Metrics of a field over a made-up ground: what counts, what is averaged, what is left out."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch
from fixtures import lpips_arrays

from dav_gswt.reconstruction import evaluation


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
