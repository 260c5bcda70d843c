"""Metrics of a field over a made-up ground: what counts, what is averaged, what is left out."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch
from fixtures import lpips_arrays

from dav_gswt.reconstruction import evaluation


def test_a_field_that_is_right_has_no_psnr_and_full_marks():
    found = evaluation.evaluate_field(patch.field(), patch.photos(), weights=lpips_arrays.random())
    assert found["psnr"] is None  # equal pictures
    assert found["ssim"] == pytest.approx(1) and found["lpips"] == 0
    assert [row["view"] for row in found["test_views"]] == ["photo_0", "photo_1", "photo_2"]


def off(amount, views=None):
    """Photos that differ from the field by noise of a deviation each."""
    rng = np.random.default_rng(0)
    photos = views or patch.photos(len(amount), size=64)
    noisy = (np.clip(v.image + s * rng.normal(size=v.image.shape), 0, 1) for v, s in zip(photos, amount, strict=True))
    return [replace(v, image=image.astype(np.float32)) for v, image in zip(photos, noisy, strict=True)]


def test_means_groups_and_the_worst_tenth():
    tests = off([0.02, 0.02, 0.1])
    groups = {"high": ["photo_0", "photo_1"], "low": ["photo_2"], "none": ["elsewhere"]}
    found = evaluation.evaluate_field(patch.field(), tests, groups, lpips_arrays.random())
    rows = found["test_views"]
    for key in evaluation.MEASURES:
        values = [row[key] for row in rows]
        assert found[key] == pytest.approx(np.mean(values)) and found["worst_decile"][key] == pytest.approx(values[2])
        assert found["groups"]["low"][key] == values[2] and found["groups"]["none"][key] is None
        assert found["groups"]["high"][key] == pytest.approx(np.mean(values[:2]))
    assert rows[0]["psnr"] == pytest.approx(-20 * np.log10(0.02), abs=1.5) and rows[2]["lpips"] > rows[0]["lpips"]


def test_exposure_is_forgiven_where_it_is_said():
    dim = [replace(v, image=0.8 * v.image) for v in off([0.01], patch.photos(1))]
    found = evaluation.evaluate_field(patch.field(), dim)
    assert found["psnr_colour_corrected"] > found["psnr"] + 5


def test_pixels_that_do_not_count_change_nothing():
    (view,) = off([0.05], patch.photos(1, size=64))
    weight = view.weight.copy()
    weight[:, 32:] = 0
    spoilt = view.image.copy()
    spoilt[:, 33:] = 1
    one, two = (
        evaluation.evaluate_field(patch.field(), [replace(view, image=image, weight=weight)])
        for image in (view.image, spoilt)
    )
    assert one["psnr"] == pytest.approx(two["psnr"]) and one["psnr_colour_corrected"] == two["psnr_colour_corrected"]
    blind = replace(view, weight=np.zeros_like(weight))
    assert evaluation.evaluate_field(patch.field(), [blind])["psnr"] is None


def test_lpips_counts_by_the_area_that_counts():
    """The same wrong half, seen alone or beside a right half: as far off where it counts."""
    (view,) = patch.photos(1, size=96)
    wrong = view.image.copy()
    wrong[:, :48] = 1 - wrong[:, :48]
    half = np.zeros_like(view.weight)
    half[:, :48] = 1
    weights = lpips_arrays.random()
    alone, beside = (
        evaluation.evaluate_field(patch.field(), [replace(view, image=wrong, weight=w)], weights=weights)["lpips"]
        for w in (half, view.weight)
    )
    assert alone == pytest.approx(2 * beside, rel=1e-3)


def test_without_weights_lpips_is_null_and_that_is_said(caplog):
    with caplog.at_level(logging.INFO):
        found = evaluation.evaluate_field(patch.field(), off([0.02]))
    assert found["lpips"] is found["worst_decile"]["lpips"] is None and "metrics lack LPIPS" in caplog.text


def test_no_test_view_is_null():
    found = evaluation.evaluate_field(patch.field(), [])
    assert found["psnr"] is found["worst_decile"]["ssim"] is None and found["test_views"] == []
