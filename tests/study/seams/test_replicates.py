"""Replicates of tile sets: entries of their own, and rows that count as other places of the same seam."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.study import csv_tables
from dav_gswt.study.seams import replicates, summary, tables
from dav_gswt.tiles import build

TILINGS = {"semantic": {"tile": 0.5, "strip": 0.06, "candidates": 9, "variants": 1}, "small": {"tile": 0.3}}
SCENES = {"desert": {"tiling": "semantic-refined"}, "beach": {"tiling": "small"}, "moon": {"tiling": "semantic"}}
ONCE = {"tilings": [], "replicates": 1, "compared_replicates": 1}


def config(**study):
    return {"scenes": SCENES, "tilings": dict(TILINGS), "seams": {"scenes": ["desert", "beach"]} | ONCE | study}


def test_the_own_tiling_of_every_scene_has_an_entry_for_each_replicate():
    entries = replicates.add_replicates(config(replicates=3))["tilings"]
    assert list(entries) == [*TILINGS, *(f"{name}-replicate-{k}" for name in ("semantic", "small") for k in (1, 2))]
    assert entries["semantic-replicate-2"] == TILINGS["semantic"] | {"replicate": 2}
    assert entries["small"] == TILINGS["small"]


def test_without_replicates_the_config_stays_as_it_is():
    assert replicates.add_replicates({"tilings": TILINGS})["tilings"] == TILINGS
    assert replicates.add_replicates(config())["tilings"] == TILINGS


def test_a_refined_tiling_is_refined_in_every_replicate():
    names = replicates.list_replicates("semantic-refined", "semantic-refined", ONCE | {"replicates": 2})
    assert names == ["semantic-refined", "semantic-replicate-1-refined"]
    assert replicates.list_replicates("small", "small", ONCE) == ["small"]


@pytest.mark.parametrize("own, counts", [(1, (2, 2)), (3, (3, 2))], ids=["more are compared", "more of the own tiling"])
def test_compared_tilings_have_as_many_replicates_as_the_study_says(own, counts):
    study = {"tilings": ["semantic", "small"], "compared_replicates": 2, "replicates": own}
    assert tuple(len(replicates.list_replicates(name, "semantic", study)) for name in ("semantic", "small")) == counts
    assert replicates.list_replicates("other", "semantic", study) == []
    entries = replicates.add_replicates(config(tilings=["small"], compared_replicates=2))["tilings"]
    assert list(entries) == [*TILINGS, "small-replicate-1"]
    assert entries["small-replicate-1"] == TILINGS["small"] | {"replicate": 1}


def test_an_entry_of_such_a_name_is_an_error():
    taken = config(replicates=2)
    taken["tilings"]["small-replicate-1"] = {"tile": 0.4}
    with pytest.raises(InputError, match="tilings.small-replicate-1: `study.seams` makes an entry of this name"):
        replicates.add_replicates(taken)


def test_the_first_replicate_is_the_entry_itself_and_no_two_are_equal():
    found = [build.make_generator(7, {"replicate": k} if k else {}).random(4) for k in range(3)]
    np.testing.assert_array_equal(found[0], np.random.default_rng(7).random(4))
    np.testing.assert_array_equal(found[0], build.make_generator(7, {"replicate": 0}).random(4))
    assert len({tuple(values) for values in found}) == 3


def test_crops_of_another_replicate_are_other_places_of_the_same_seam(tmp_path):
    places = {"border": 0.11, "cut": 0.12, "ceiling": 0.13, "floor": 0.1}
    about = {"view": "top", "ground": "flat", "psnr": 30.0, "jump": 1.0}
    rows = []
    for draw in range(2):
        crops = [
            {"place": place} | about | {"crop": crop, "cluster": f"v{crop}", "seam_lpips": value + 0.01 * draw}
            for crop in range(3)
            for place, value in places.items()
        ]
        csv_tables.write_table(tmp_path / f"{draw}.csv", crops)
        write_json(tmp_path / "facts.json", {"provenance": {"version": "1", "inputs": {"seams": "abc"}}})
        cell = {"scene": "desert", "seed": 0, "preset": "draft", "variant": "semantic", "replicate": draw}
        rows += tables.tabulate_crops(cell | {"table": tmp_path / f"{draw}.csv", "facts": tmp_path / "facts.json"})
    (every,) = [row for row in summary.summarise_crops(rows) if row["view"] == summary.EVERY]
    assert (every["sets"], every["borders"], every["border_clusters"]) == (2, 6, 6)
    assert every["border"] == pytest.approx(0.01) and every["cut"] == pytest.approx(0.02)
    (once,) = [row for row in summary.summarise_crops(rows[: len(rows) // 2]) if row["view"] == summary.EVERY]
    assert (once["sets"], once["border_clusters"]) == (1, 3)
