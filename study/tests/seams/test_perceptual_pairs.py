import numpy as np
import pytest
from fixtures import lpips_arrays
from scipy.ndimage import binary_erosion

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt_study.forced_choice import kit, pairs
from dav_gswt_study.seams import measure
from dav_gswt_study.seams.crops import SIDE

ASKED = {"pairs": [["colour", "none"], ["colour", "floor"]], "crops": 2, "checks": 1, "size": 80, "seed": 0}


@pytest.fixture(scope="module")
def sets(placed, straight):
    return {"colour": placed, "none": straight}


@pytest.fixture(scope="module")
def items(sets):
    return pairs.sample_pairs(sets, ASKED, None)


def named(items, second):
    return [item for item in items if item.halves[1].name == second]


def middle(picture):
    first = (len(picture) - SIDE) // 2
    return picture[first : first + SIDE, first : first + SIDE]


def test_there_are_as_many_as_asked_for_in_turn_of_every_look_and_no_place_twice(items):
    assert [len(named(items, name)) for name in ("none", "floor", "check")] == [2, 2, 1]
    assert [item.view for item in named(items, "none")] == ["near", "walker"]
    assert len({item.cluster for item in items}) == len(items)
    for half in (half for item in named(items, "none") for half in item.halves):
        assert half.picture.shape == (80, 80, 3) and len(half.shown.patches) > 1
        np.testing.assert_allclose(middle(half.picture), half.shown.picture, atol=0.01)  # rims of what lies outside


def test_the_floor_is_the_same_ground_as_one_patch_and_a_check_has_a_half_that_is_much_darker(items):
    """Where the crop shows the patch of the floor it is like it more than like another."""
    for item in named(items, "floor"):
        cut, whole = item.halves
        like = [metrics.psnr(middle(whole.picture), own, np.ones((SIDE, SIDE))) for own in cut.shown.own]
        shown = int(np.argmax([each or np.inf for each in like]))
        assert (like[shown] or 99) > 60
        inner = binary_erosion(cut.shown.patch == shown, iterations=6)  # Gaussians reach over the cut
        near = [metrics.psnr(middle(cut.picture), own, inner.astype(float)) for own in cut.shown.own]
        assert all(near[shown] > other for k, other in enumerate(near) if k != shown)
    plain, spoilt = (half.picture for half in named(items, "check")[0].halves)
    changed = (plain != spoilt).any(2)
    assert 0.45 < changed.mean() <= 0.5
    assert spoilt[changed].mean() < 0.75 * plain[changed].mean()


def test_the_same_seed_draws_the_same_pairs_and_the_model_observer_judges_what_has_a_seam(sets, items, monkeypatch):
    monkeypatch.setattr(measure, "BANK_SIZE", 40)
    again = pairs.sample_pairs(sets, ASKED | {"crops": 1}, lpips_arrays.random())
    np.testing.assert_array_equal(again[0].halves[1].picture, named(items, "none")[0].halves[1].picture)
    over = {item.halves[1].name: item.over for item in again}
    assert over["check"] == (None, None) and over["floor"][1] == 0.0
    assert all(np.isfinite(value) and value != 0 for value in (*over["none"], over["floor"][0]))


def test_what_is_written_is_read_again(items, tmp_path):
    kit.write_pairs(tmp_path / "pairs", items, {})
    read = kit.read_pairs(tmp_path / "pairs", "desert")
    compared = [(pair.about["scene"], pair.about["a"], pair.about["b"]) for pair in read]
    assert compared == [("desert", *(half.name for half in item.halves)) for item in items]
    assert [pair.check for pair in read].count(True) == 1
    (tmp_path / "pairs/001_b.png").unlink()
    with pytest.raises(InputError, match="001_b.png"):
        kit.read_pairs(tmp_path / "pairs", "desert")
