import numpy as np
import pytest

from dav_gswt_study import experiments
from dav_gswt_study.seams import summary

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
