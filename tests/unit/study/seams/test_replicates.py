"""Tile sets drawn anew: entries of their own, and rows that count as other places of the same seam."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.study import csv_tables
from dav_gswt.study.seams import replicates, summary, tables
from dav_gswt.tiles import build

SEAMS = {"semantic": {"tile": 0.5, "strip": 0.06, "candidates": 9, "variants": 1}, "small": {"tile": 0.3}}
SCENES = {"desert": {"tiling": "semantic-refined"}, "beach": {"tiling": "small"}, "moon": {"tiling": "semantic"}}


def config(**study):
    return {"scenes": SCENES, "seams": dict(SEAMS), "seam_study": {"scenes": ["desert", "beach"], "seams": []} | study}


def test_every_scenes_own_seam_has_an_entry_for_each_draw():
    made = replicates.entries(config(draws=3))["seams"]
    assert list(made) == [*SEAMS, *(f"{name}-draw-{k}" for name in ("semantic", "small") for k in (1, 2))]
    assert made["semantic-draw-2"] == SEAMS["semantic"] | {"draw": 2} and made["small"] == SEAMS["small"]
    assert replicates.entries({"seams": SEAMS})["seams"] == replicates.entries(config())["seams"] == SEAMS


def test_a_refined_seam_is_refined_in_every_draw():
    found = replicates.asked("semantic-refined", "semantic-refined", {"seams": [], "draws": 2})
    assert found == ["semantic-refined", "semantic-draw-1-refined"]
    assert replicates.asked("small", "small", {"seams": []}) == ["small"]


@pytest.mark.parametrize(
    "own, times", [({"draws": 1}, (2, 2)), ({"draws": 3}, (3, 2))], ids=["more are compared", "own drawn more often"]
)
def test_seams_that_are_compared_are_drawn_as_often_as_is_asked(own, times):
    study = {"seams": ["semantic", "small"], "compared_draws": 2} | own
    assert tuple(len(replicates.asked(seam, "semantic", study)) for seam in ("semantic", "small")) == times
    assert replicates.asked("other", "semantic", study) == []
    made = replicates.entries(config(seams=["small"], compared_draws=2))["seams"]
    assert list(made) == [*SEAMS, "small-draw-1"] and made["small-draw-1"] == SEAMS["small"] | {"draw": 1}


def test_an_entry_of_such_a_name_is_told():
    taken = config(draws=2)
    taken["seams"]["small-draw-1"] = {"tile": 0.4}
    with pytest.raises(InputError, match="seams.small-draw-1: `seam_study` makes an entry of this name"):
        replicates.entries(taken)


def test_the_first_draw_is_the_entry_itself_and_no_two_are_alike():
    found = [build.make_generator(7, {"draw": k} if k else {}).random(4) for k in range(3)]
    np.testing.assert_array_equal(found[0], np.random.default_rng(7).random(4))
    np.testing.assert_array_equal(found[0], build.make_generator(7, {"draw": 0}).random(4))
    assert len({tuple(values) for values in found}) == 3


def test_crops_of_another_draw_are_other_places_of_the_same_seam(tmp_path):
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
        cell = {"scene": "desert", "seed": 0, "preset": "draft", "variant": "semantic", "draw": draw}
        rows += tables.tabulate_crops(cell | {"table": tmp_path / f"{draw}.csv", "facts": tmp_path / "facts.json"})
    (every,) = [row for row in summary.summary(rows) if row["view"] == summary.EVERY]
    assert (every["sets"], every["borders"], every["border_clusters"]) == (2, 6, 6)
    assert every["border"] == pytest.approx(0.01) and every["cut"] == pytest.approx(0.02)
    (once,) = [row for row in summary.summary(rows[: len(rows) // 2]) if row["view"] == summary.EVERY]
    assert (once["sets"], once["border_clusters"]) == (1, 3)
