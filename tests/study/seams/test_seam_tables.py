"""Summaries: hand-worked means, intervals that know clusters, shares that are unknown, rows that add up; repeats."""

import numpy as np
import pytest

from dav_gswt.study.seams import repetition, summary

ABOUT = {
    "scene": "desert",
    "seed": 0,
    "preset": "draft",
    "variant": "colour",
    "version": "1",
    "weights": "",
    "tiles": "",
}


def crop(place, number, cluster, value, floor, **more):
    about = {"view": "top", "ground": "flat", "crop": number, "cluster": cluster, "psnr": 30.0, "jump": 1.5}
    own = ABOUT | {"place": place} | about | {"seam_lpips": value} | more
    return [own, ABOUT | {"place": "floor"} | about | {"seam_lpips": floor, "psnr": None, "jump": 1.0} | more]


def table(cut=0.01, ceiling=0.05, noise=0.001, variant="colour"):
    rng, rows = np.random.default_rng(0), []
    for k in range(40):
        for place, more in (("border", 0.0), ("cut", cut), ("ceiling", ceiling)):
            number = k + {"border": 0, "cut": 40, "ceiling": 80}[place]
            rows += crop(place, number, f"{k // 2}", 0.1 + more + noise * rng.normal(), 0.1, variant=variant)
    return rows


def test_differences_and_shares_are_those_put_in():
    every = next(row for row in summary.summarise_crops(table()) if row["view"] == summary.EVERY)
    assert every["border"] == pytest.approx(0, abs=5e-4) and every["border_low"] < 0 < every["border_high"]
    assert every["share"] == pytest.approx(0.2, abs=0.02) and every["share_low"] < 0.2 < every["share_high"]
    assert (every["borders"], every["border_clusters"]) == (40, 20)


def test_where_the_ceiling_is_not_told_from_the_floor_there_is_no_share():
    every = summary.summarise_crops(table(ceiling=-0.01, noise=0.02))[0]
    assert every["ceiling_low"] < 0 and every["share"] is None


def test_without_lpips_there_is_none_in_the_summary():
    rows = [row | {"seam_lpips": None} for row in table()]
    every = summary.summarise_crops(rows)[0]
    assert every["border"] is None and every["share"] is None and every["cut_psnr"] == pytest.approx(30)


def test_a_variant_is_compared_with_the_baseline_in_the_same_clusters():
    rows = table() + table(cut=0.03, variant="none")
    found = summary.compare_variants(rows, "colour")
    row = next(r for r in found if r["measure"] == "seam_lpips")
    assert row["variant"] == "none" and row["difference"] == pytest.approx(0.02, abs=1e-3)
    assert row["difference_low"] > 0.018


def test_autocorrelation_is_that_of_the_slow_sum():
    picture = np.random.default_rng(0).random((6, 5, 3))
    found = repetition.autocorrelate(picture)
    f = picture - picture.mean((0, 1))
    for dy, dx in ((0, 0), (1, 2), (3, 0)):
        slow = (f[: 6 - dy, : 5 - dx] * f[dy:, dx:]).sum(-1).mean() / (f**2).sum(-1).mean()
        assert found[6 + dy, 5 + dx] == pytest.approx(slow) == pytest.approx(found[6 - dy, 5 - dx])
    assert not repetition.autocorrelate(np.full((4, 4, 3), 0.5)).any()


def test_a_picture_that_repeats_stands_out_at_its_period_and_noise_does_not():
    rng = np.random.default_rng(1)
    tile = rng.random((32, 32, 3))
    for picture, repeats in ((np.tile(tile, (6, 6, 1)), True), (rng.random((192, 192, 3)), False)):
        r = repetition.autocorrelate(picture)
        found = repetition.tabulate_repetition(repetition.Autocorrelations(r, r, 32))
        assert all((row["terrain"] > 2 * row["around"]) == repeats for row in found)
        assert found[0]["terrain"] == pytest.approx(1 if repeats else 0, abs=0.05)
