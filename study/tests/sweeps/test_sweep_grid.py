import pytest
from study_configs import check_flat, flat_config

from dav_gswt.errors import InputError
from dav_gswt_study.sweeps import grid

ROW = {"scenes": ["desert_pool"], "vary": {"k": [2, 4]}, "measure": {"views": [0]}}


def test_every_combination_comes_once_and_says_what_was_varied():
    found = grid.list_combinations({"k": [2, 4], "tau": [0.3, 0.6]}, {"policy": "farthest"})
    assert [(f["k"], f["tau"]) for f in found] == [(2, 0.3), (2, 0.6), (4, 0.3), (4, 0.6)]
    assert all(f["policy"] == "farthest" and f["shown"] == {"k": f["k"], "tau": f["tau"]} for f in found)
    own = [{"policy": "w2", "prior": "terrain-m2", "p_drop": 0}]  # settings of the policy's own
    (found,) = grid.list_combinations({"policy": own}, {"p_drop": 0.3})
    assert found == own[0] | {"shown": {"policy": "w2"}}


def test_rounds_are_those_asked_for_or_as_many_as_photos_have_room_for():
    for photos, rounds in ((None, 3), (20, 3), (19, 2)):
        assert grid.count_rounds({"photos": photos} if photos else {}, "farthest", start=8, k=4, rounds=3) == rounds
    assert grid.count_rounds({}, "all", start=8, k=4, rounds=3) == 1
    assert grid.count_rounds({}, "all", start=8, k=4, rounds=0) == 0
    assert grid.list_seeds({"views": [2, 0], "seams": [0, 1]}) == [0, 1, 2]


@pytest.mark.parametrize(
    "table, change, said",
    [
        ("mine", {"vary": {"kk": [2]}}, "sweeps.mine.vary: there is no key 'kk'"),
        ("mine", {"measure": {}}, "nothing is measured"),
        ("mine", {"fixed": {"k": 4}}, "sweeps.mine.fixed.k: is varied already"),
        ("mine", {"scenes": ["moon"]}, "sweeps.mine.scenes: moon is no scene"),
        ("mine", {"vary": {"tiling": ["glue"]}}, "there is no tiling 'glue'"),
        ("mine", {"vary": {"lam": [0, 1]}}, "lam: makes no difference to the policy auto"),
        ("mine", {"fixed": {"photos": 10}}, "photos: 10 leave no round of 4"),
        ("mine", {"fixed": {"photos": 20, "rounds": 2}}, "photos and rounds"),
        ("tables", {"timing": "speed"}, "there is no sweep 'speed'"),
        ("tables", {"ablation": ["k"]}, "sweeps.k.baseline: must be one of 2, 4, 8"),
    ],
)
def test_what_makes_no_sense_is_named(table, change, said):
    config = flat_config()
    mine, tables = (ROW | change, {}) if table == "mine" else (ROW, change)
    check_flat(config | {"sweeps": config["sweeps"] | {"mine": ROW}})
    sweeps = config["sweeps"] | {"mine": mine}
    with pytest.raises(InputError, match=said):
        check_flat(config | {"sweeps": sweeps, "tables": config["tables"] | tables})
