"""Combinations of what is varied, rounds from photos, and rows of the config that make no sense."""

from copy import deepcopy

import pytest
from fixtures.configs import check_flat, flat_config

from dav_gswt.errors import InputError
from dav_gswt.study.sweeps import grid


def test_every_combination_comes_once_and_says_what_was_varied():
    found = grid.list_combinations({"k": [2, 4], "tau": [0.3, 0.6]}, {"policy": "farthest"})
    assert [(f["k"], f["tau"]) for f in found] == [(2, 0.3), (2, 0.6), (4, 0.3), (4, 0.6)]
    assert all(f["policy"] == "farthest" and f["shown"] == {"k": f["k"], "tau": f["tau"]} for f in found)


def test_a_policy_may_bring_settings_of_its_own():
    (found,) = grid.list_combinations(
        {"policy": [{"policy": "w2", "prior": "independent", "p_drop": 0}]}, {"p_drop": 0.3}
    )
    assert found == {"policy": "w2", "prior": "independent", "p_drop": 0, "shown": {"policy": "w2"}}


@pytest.mark.parametrize(
    "chosen, policy, rounds",
    [
        ({}, "farthest", 3),
        ({"photos": 20}, "farthest", 3),
        ({"photos": 19}, "farthest", 2),
        ({"photos": 20}, "all", 1),
        ({}, "all", 1),
    ],
)
def test_rounds_are_those_asked_for_or_as_many_as_photos_have_room_for(chosen, policy, rounds):
    assert grid.count_rounds(chosen, policy, start=8, k=4, rounds=3) == rounds
    assert grid.count_rounds({}, "all", start=8, k=4, rounds=0) == 0


def test_all_seeds_of_which_anything_is_measured_count():
    assert grid.list_seeds({"views": [2, 0], "seams": [0, 1]}) == [0, 1, 2]


ROW = {"scenes": ["desert_pool"], "vary": {"k": [2, 4]}, "measure": {"views": [0]}}


@pytest.mark.parametrize(
    "row, said",
    [
        pytest.param({"vary": {"kk": [2]}}, "sweeps.mine.vary: there is no key 'kk'", id="a typo"),
        pytest.param({"vary": {"tau": [1.5]}}, "sweeps.mine.vary.tau.0: .*less than or equal to 1", id="out of range"),
        pytest.param({"measure": {}}, "sweeps.mine.measure: .*measured", id="nothing measured"),
        pytest.param({"fixed": {"k": 4}}, "sweeps.mine.fixed.k: is varied already", id="varied and fixed"),
        pytest.param({"scenes": ["moon"]}, "sweeps.mine.scenes: moon is no scene", id="no such scene"),
        pytest.param({"vary": {"tiling": ["glue"]}}, "there is no tiling 'glue'", id="no such tiling"),
        pytest.param({"vary": {"prior": ["zero"]}}, "there is no prior 'zero'", id="no such prior"),
        pytest.param({"fixed": {"preset": "best"}}, "there is no preset 'best'", id="no such preset"),
        pytest.param({"vary": {"lam": [0, 1]}}, "lam: makes no difference to the policy auto", id="no prior asked"),
        pytest.param({"fixed": {"photos": 10}}, "photos: 10 leave no round of 4", id="no round"),
        pytest.param({"fixed": {"photos": 20, "rounds": 2}}, "photos and rounds", id="photos and rounds"),
    ],
)
def test_a_row_that_makes_no_sense_is_named(row, said):
    config = flat_config()
    check_flat(config | {"sweeps": config["sweeps"] | {"mine": ROW}})
    broken = config | {"sweeps": config["sweeps"] | {"mine": deepcopy(ROW) | row}}
    with pytest.raises(InputError, match=f"config: .*{said}"):
        check_flat(broken)


@pytest.mark.parametrize(
    "change, said",
    [
        ({"timing": "speed"}, "there is no sweep 'speed'"),
        ({"ablation": ["k"]}, "sweeps.k.baseline: must be one of 2, 4, 8"),
        ({"figures": {"scenes": ["moon"]}}, "study.tables.figures.scenes: moon is no scene"),
    ],
)
def test_a_study_of_what_is_not_there_is_named(change, said):
    config = flat_config()
    figures = config["tables"]["figures"] | change.get("figures", {})
    tables = config["tables"] | change | {"figures": figures}
    with pytest.raises(InputError, match=said):
        check_flat(config | {"tables": tables})
