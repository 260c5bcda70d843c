"""A changed config key makes again what reads it, and nothing else."""

import json

import pytest
from fixtures.runs import TINY, USUAL

LOOK = {"make_page", "render_terrain", "make_contact_sheet"}
TILES = {"cut_tiles", "bundle_tiles"} | LOOK
LEVELS = {"make_levels", "find_materials"} | TILES
ROUND = {"select_poses", "capture_views", "update_field", "score_round", "evaluate_round"}
FIT = {"fit_coarse", "evaluate_coarse", "score_coarse"} | ROUND
TABLE = [  # changed keys, and the rules that must run again on a finished run of the synthetic scene
    ({"stills": {"width": 320, "height": 180}}, LOOK),
    ({"heights": {"kind": "hills", "height": 2, "wavelength": 20}}, LOOK),
    ({"tau": 0.3}, {"bundle_tiles"} | LOOK),
    ({"tilings": {"semantic": {"slope": 3}}}, TILES),
    ({"levels": 2, "presets": {"draft": {"level_steps": 11}}}, LEVELS),
    ({"k": 3}, ROUND | LEVELS),
    ({"presets": {"draft": {"steps": 61}}}, FIT | LEVELS),
    ({"seeds": [1]}, {"split_views"} | FIT | LEVELS),
    ({"scenes": {"desert": {"seed": 101}}}, {"render_photos", "report_photos", "split_views"} | FIT | LEVELS),
    ({"scenes": {"planet": {"seed": 7}}, "priors": {"terrain": {"samples": 3}}}, set()),
]


@pytest.mark.parametrize("change, rules", TABLE, ids=[json.dumps(change) for change, _ in TABLE])
def test_a_changed_key_makes_again_what_reads_it(tiny, planned, tmp_path, change, rules):
    (tmp_path / "change.json").write_text(json.dumps(change))
    plan = planned(tiny.folder, configs=(USUAL, TINY, tmp_path / "change.json"))
    assert set(plan) - {"all"} == rules


def test_a_second_run_plans_nothing(tiny, planned):
    assert not planned(tiny.folder, configs=(USUAL, TINY))


def test_another_round_goes_on_from_the_last_one(tiny, planned):
    plan = planned(tiny.folder, "--config", "rounds=2", configs=(USUAL, TINY))
    assert not {"fit_coarse", "score_coarse"} & set(plan) and plan["update_field"] == plan["evaluate_round"] == 1
