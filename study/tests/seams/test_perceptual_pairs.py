import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt_study.forced_choice import kit, pairs
from dav_gswt_study.seams import crops, places

ASKED = {"pairs": [["colour", "none"], ["colour", "floor"]], "crops": 2, "checks": 1, "size": 80, "seed": 0}


@pytest.fixture(scope="module")
def sets(placed, straight):
    return {"colour": placed, "none": straight}


@pytest.fixture(scope="module")
def items(sets):
    return pairs.sample_pairs(sets, ASKED)


def named(items, second):
    return [item for item in items if item.halves[1].name == second]


def test_there_are_as_many_as_asked_for_in_turn_of_every_look_and_no_place_twice(items):
    assert [len(named(items, name)) for name in ("none", "floor", "check")] == [2, 2, 1]
    assert [item.view for item in named(items, "none")] == ["near", "walker"]
    assert len({item.cluster for item in items}) == len(items)
    assert all(half.picture.shape == (80, 80, 3) for item in items for half in item.halves)


def test_the_floor_is_one_patch_of_the_cut_alone(placed, rng):
    look = pairs.Setup(crops.VIEWS[0], "flat", 80, {"colour": (placed, placed.terrain)})
    drawn = ((place, pairs._render_floor(look, "colour", place)) for place in places.sample_cuts(placed, rng))
    place, whole = next(each for each in drawn if each[1])
    crop, patches, _ = pairs._find_crops(look, "colour", place)
    inner = whole.picture[16:-16, 16:-16]
    shown = crops.render_patches(placed, placed.terrain, crop, patches).own
    assert max(metrics.psnr(inner, own, np.ones(inner.shape[:2])) or 99 for own in shown) > 60


def test_a_check_has_a_half_that_is_much_darker(items):
    plain, spoilt = (half.picture for half in named(items, "check")[0].halves)
    changed = (plain != spoilt).any(2)
    assert 0.45 < changed.mean() <= 0.5
    assert spoilt[changed].mean() < 0.75 * plain[changed].mean()


def test_the_same_seed_draws_the_same_pairs(sets, items):
    again = pairs.sample_pairs(sets, ASKED | {"crops": 1})
    np.testing.assert_array_equal(again[0].halves[1].picture, named(items, "none")[0].halves[1].picture)


def test_what_is_written_is_read_again(items, tmp_path):
    kit.write_pairs(tmp_path / "pairs", items, {})
    read = kit.read_pairs(tmp_path / "pairs", "desert")
    compared = [(pair.about["scene"], pair.about["a"], pair.about["b"]) for pair in read]
    assert compared == [("desert", *(half.name for half in item.halves)) for item in items]
    assert [pair.check for pair in read].count(True) == 1
    (tmp_path / "pairs/001_b.png").unlink()
    with pytest.raises(InputError, match="001_b.png"):
        kit.read_pairs(tmp_path / "pairs", "desert")
