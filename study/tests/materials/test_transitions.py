import numpy as np
import pytest
from fixtures import lpips_arrays

from dav_gswt.errors import InputError
from dav_gswt_study.materials import transitions
from dav_gswt_study.materials.transitions import CELLS, PIXELS, MaterialMap

SIDE = 4 * CELLS
HALVES = (np.arange(SIDE) >= SIDE // 2).astype(int) * np.ones((SIDE, 1), int)
WEIGHTS = lpips_arrays.random()


def stripes(material, seed=0, noise=0.05):
    """A picture of two colours where the material says so."""
    rng = np.random.default_rng(seed)
    colours = np.array([[0.8, 0.7, 0.5], [0.2, 0.5, 0.2]])[np.maximum(material, 0)]
    picture = colours.repeat(PIXELS, 0).repeat(PIXELS, 1)
    picture = picture + noise * rng.normal(size=picture.shape[:2])[..., None]
    return MaterialMap(np.clip(picture, 0, 1).astype(np.float32), material)


def test_borders_are_found_where_two_materials_have_room_and_insides_show_no_other():
    places = transitions.find_borders(HALVES, 8)
    middles = places[:, 1] + CELLS / 2
    assert len(places) and (np.abs(middles - SIDE / 2) <= 0.3 * CELLS + 1).all()
    excluded = HALVES.copy()
    excluded[:, SIDE // 2 - 12 : SIDE // 2 + 12] = -1
    assert len(transitions.find_borders(excluded, 8)) == len(transitions.find_borders(0 * HALVES, 8)) == 0
    places = transitions.find_insides(HALVES, 8, 0)
    assert len(places) and (places[:, 1] + CELLS <= SIDE / 2 + 1).all()
    assert len(transitions.find_insides(0 * HALVES, 8, 1)) == 0


def test_crops_are_turned_into_all_symmetries_and_the_nearest_allowed_ones_count():
    turned = transitions.turn_crops(np.arange(12.0, dtype=np.float32).reshape(1, 2, 2, 3))
    assert len(turned) == 8 and len({each.tobytes() for each in turned}) == 8
    apart = np.tile(np.array([[0.0, 1.0, 2.0, 3.0, 9.0]]), (1, 8))
    allowed = np.array([[False, True, True, True, True]])
    assert transitions.average_nearest(apart, allowed)[0] == pytest.approx(2.0)
    assert np.isnan(transitions.average_nearest(apart, np.zeros((1, 5), bool))[0])


def test_like_borders_are_as_near_and_others_farther_and_only_rough_ground_is_so_inside_too(monkeypatch):
    monkeypatch.setattr(transitions, "STEP", 24)
    monkeypatch.setattr(transitions, "CROPS", 8)

    def measure(terrain):
        return transitions.measure_transitions(stripes(HALVES), terrain, WEIGHTS, 0)

    like = measure(stripes(HALVES, 1))
    assert like.low <= 0
    other = measure(stripes((np.indices((SIDE, SIDE)).sum(0) // 3) % 2, 1))
    assert other.low > 0 and other.terrain > 2 * like.terrain
    rough = measure(stripes(HALVES, 1, noise=0.3))
    assert rough.low > 0 and rough.inside > 0.5 * rough.difference > like.inside
    fringe, middle = stripes(HALVES, 1), PIXELS * SIDE // 2
    fringe.picture[:, middle - 8 : middle + 8] = [1, 0, 0]
    found = measure(fringe)
    assert found.low > 0 and abs(found.inside) < 0.5 * found.difference
    with pytest.raises(InputError, match="too few borders"):
        transitions.measure_transitions(stripes(0 * HALVES), stripes(HALVES), WEIGHTS, 0)
