import numpy as np
import pytest

from dav_gswt_study import experiments
from dav_gswt_study.seams import repetition, summary

ABOUT = {"scene": "desert", "seed": 0, "preset": "draft", "version": "1", "weights": "", "tiles": ""}
ABOUT |= {"view": "top", "ground": "flat"}


def table(cut=0.01, ceiling=0.05, noise=0.001, variant="colour"):
    """40 crops of each place, two of each cluster, all with the same floor."""
    rng, rows = np.random.default_rng(0), []
    for k in range(40):
        for number, (place, more) in enumerate((("border", 0.0), ("cut", cut), ("ceiling", ceiling))):
            about = ABOUT | {"variant": variant, "crop": k + 40 * number, "cluster": f"{k // 2}"}
            value = 0.1 + more + noise * rng.normal()
            rows.append(about | {"place": place, "seam_lpips": value, "psnr": 30.0, "jump": 1.5})
            rows.append(about | {"place": "floor", "seam_lpips": 0.1, "psnr": None, "jump": 1.0})
    return rows


def test_shares_are_those_put_in_and_none_where_the_ceiling_is_not_told_from_the_floor_or_without_lpips():
    every = next(row for row in summary.summarise_crops(table()) if row["view"] == summary.EVERY)
    assert every["border"] == pytest.approx(0, abs=5e-4) and every["border_low"] < 0 < every["border_high"]
    assert every["share"] == pytest.approx(0.2, abs=0.02) and every["share_low"] < 0.2 < every["share_high"]
    assert (every["borders"], every["border_clusters"]) == (40, 20)
    every = summary.summarise_crops(table(ceiling=-0.01, noise=0.02))[0]
    assert every["ceiling_low"] < 0 and every["share"] is None
    every = summary.summarise_crops([row | {"seam_lpips": None} for row in table()])[0]
    assert every["border"] is None and every["share"] is None and every["cut_psnr"] == pytest.approx(30)


def test_a_variant_is_compared_with_the_baseline_in_the_same_clusters():
    found = summary.compare_variants(table() + table(cut=0.03, variant="none"), "colour")
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


TILINGS = {"semantic": {"tile": 0.5, "strip": 0.06, "candidates": 9, "variants": 1}, "small": {"tile": 0.3}}
SCENES = {"desert": {"tiling": "semantic-expansion"}, "beach": {"tiling": "small"}, "moon": {"tiling": "semantic"}}
ONCE = {"tilings": [], "replicates": 1, "compared_replicates": 1}


def config(**study):
    return {"scenes": SCENES, "tilings": dict(TILINGS), "seams": {"scenes": ["desert", "beach"]} | ONCE | study}


def test_the_own_tiling_of_every_scene_has_an_entry_for_each_replicate():
    entries = experiments.add_replicates(config(replicates=3))["tilings"]
    assert list(entries) == [*TILINGS, *(f"{name}-replicate-{k}" for name in ("semantic", "small") for k in (1, 2))]
    assert entries["semantic-replicate-2"] == TILINGS["semantic"] | {"replicate": 2}
    assert experiments.add_replicates(config())["tilings"] == TILINGS
