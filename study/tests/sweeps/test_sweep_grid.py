import pytest
from study_configs import check_flat, flat_config

from dav_gswt.errors import InputError
from dav_gswt_study import experiments as grid

ROW = {"scenes": ["desert_pool"], "vary": {"k": [2, 4]}, "measure": {"views": [0]}}


def test_every_combination_comes_once_and_says_what_was_varied():
    found = grid.list_combinations({"k": [2, 4], "tau": [0.3, 0.6]}, {"policy": "farthest"})
    assert [(f["k"], f["tau"]) for f in found] == [(2, 0.3), (2, 0.6), (4, 0.3), (4, 0.6)]
    assert all(f["policy"] == "farthest" and f["shown"] == {"k": f["k"], "tau": f["tau"]} for f in found)


def test_rounds_are_those_asked_for_or_as_many_as_photos_have_room_for():
    for photos, rounds in ((None, 3), (20, 3), (19, 2)):
        assert grid.count_rounds({"photos": photos} if photos else {}, "farthest", start=8, k=4, rounds=3) == rounds
    assert grid.count_rounds({}, "all", start=8, k=4, rounds=3) == 1
    assert grid.count_rounds({}, "all", start=8, k=4, rounds=0) == 0
    assert grid.list_seeds({"views": [2, 0], "seams": [0, 1]}) == [0, 1, 2]


@pytest.mark.parametrize(
    "change, said",
    [
        ({"vary": {"kk": [2]}}, "there is no key 'kk'"),
        ({"vary": {"p_drop": [1.5]}}, "less than 1"),
        ({"measure": {}}, "at least 1 item"),
        ({"measure": {"beauty": [0]}}, "sweeps.mine.measure"),
    ],
)
def test_what_makes_no_sense_is_named(change, said):
    sweeps = flat_config()["sweeps"]
    check_flat(flat_config() | {"sweeps": sweeps | {"mine": ROW}})
    with pytest.raises(InputError, match=said):
        check_flat(flat_config() | {"sweeps": sweeps | {"mine": ROW | change}})
