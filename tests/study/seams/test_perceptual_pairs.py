"""Pairs for people: what they show, that none shows what another does, and what the model observer judges."""

import numpy as np
import pytest
from fixtures import lpips_arrays
from scipy.ndimage import binary_erosion

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt.study.forced_choice import pairs, store
from dav_gswt.study.seams import measure
from dav_gswt.study.seams.crops import SIDE

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
    assert all(half.picture.shape == (80, 80, 3) for item in items for half in item.halves)


def test_the_middle_is_the_crop_that_is_judged(items):
    for item in named(items, "none"):
        for half in item.halves:
            assert len(half.shown.patches) > 1
            np.testing.assert_allclose(middle(half.picture), half.shown.picture, atol=0.01)  # rims of what lies outside


def test_the_floor_is_the_same_ground_as_one_patch(items):
    """The floor is one patch placed whole, and where the crop shows that patch it is like it more than like another."""
    for item in named(items, "floor"):
        cut, whole = item.halves
        like = [metrics.psnr(middle(whole.picture), own, np.ones((SIDE, SIDE))) for own in cut.shown.own]
        shown = int(np.argmax([each or np.inf for each in like]))
        assert (like[shown] or 99) > 60
        inner = binary_erosion(cut.shown.patch == shown, iterations=6)  # Gaussians reach over the cut
        shows = inner.astype(float)
        near = [metrics.psnr(middle(cut.picture), own, shows) for own in cut.shown.own]
        assert all(near[shown] > other for k, other in enumerate(near) if k != shown)


def test_a_check_has_a_half_that_is_much_darker(items):
    for item in named(items, "check"):
        plain, spoilt = (half.picture for half in item.halves)
        changed = (plain != spoilt).any(2)
        assert 0.45 < changed.mean() <= 0.5
        assert spoilt[changed].mean() < 0.75 * plain[changed].mean()


def test_the_same_seed_draws_the_same_pairs(sets, items):
    again = pairs.sample_pairs(sets, ASKED | {"crops": 1, "checks": 0}, None)
    assert [item.cluster for item in again] == [named(items, "none")[0].cluster, named(items, "floor")[0].cluster]
    np.testing.assert_array_equal(again[0].halves[1].picture, named(items, "none")[0].halves[1].picture)


def test_the_model_observer_judges_what_has_a_seam(sets, monkeypatch):
    monkeypatch.setattr(measure, "BANK_SIZE", 40)
    found = pairs.sample_pairs(sets, ASKED | {"crops": 1, "checks": 1}, lpips_arrays.random())
    over = {item.halves[1].name: item.over for item in found}
    assert over["check"] == (None, None) and over["floor"][1] == 0.0
    assert all(np.isfinite(value) and value != 0 for value in (*over["none"], over["floor"][0]))


def test_more_than_the_exemplar_holds_cannot_be_shown(sets, monkeypatch):
    monkeypatch.setattr(pairs, "MAX_PLACES", 20)
    with pytest.raises(InputError, match="only 0 of 1 crops of colour and floor .* smaller `size`"):
        pairs.sample_pairs(sets, ASKED | {"pairs": [["colour", "floor"]], "crops": 1, "size": 1200}, None)


def test_what_is_written_is_read_again(items, tmp_path):
    store.write_pairs(tmp_path / "pairs", items, {})
    read = store.read_pairs(tmp_path / "pairs", "desert")
    compared = [(pair.about["a"], pair.about["b"]) for pair in read]
    assert compared == [tuple(half.name for half in item.halves) for item in items]
    assert [pair.check for pair in read].count(True) == 1
    assert read[0].about["scene"] == "desert" and read[0].pictures[0].startswith(b"\x89PNG")
    (tmp_path / "pairs/001_b.png").unlink()
    with pytest.raises(InputError, match="001_b.png"):
        store.read_pairs(tmp_path / "pairs", "desert")
