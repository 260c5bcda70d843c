"""Meadows: what they refuse, that they repeat, where their ground is, and that what grows stands on it."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import pinhole
from dav_gswt.photos.synthetic import land, meadow
from dav_gswt.photos.synthetic import scene as synthetic

pytest.importorskip("mitsuba")
BARE = {"bare": 1, "tufts": 0, "seed_heads": 0, "clover": 0, "flowers": 0, "stones": 0, "pebbles": 0}


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Ground of few texels and no plants far away: quick to make, and otherwise the same."""
    monkeypatch.setattr(meadow, "TEXELS", 256)
    monkeypatch.setattr(meadow, "NEAR", 3.0)
    monkeypatch.setattr(meadow, "FAR", 8.0)
    yield
    synthetic._load_scene.cache_clear()


def grown(seed=0, **given):
    return meadow.make_land(land.make_options("meadow", meadow.Options, given), seed, 6.0)


@pytest.mark.parametrize(
    "given, said",
    [
        pytest.param({"flower": 3}, "meadow.*'flower'.*flowers", id="misspelt option"),
        pytest.param({"bare": 1.5}, "bare is 1.5.*0.0 to 1.0", id="a share above 1"),
        pytest.param({"grass": float("nan")}, "grass", id="NaN"),
        pytest.param({"tufts": "many"}, "tufts", id="a word"),
    ],
)
def test_what_a_meadow_cannot_be_is_said_by_name(given, said):
    with pytest.raises(InputError, match=said):
        synthetic.make_scene("meadow", 0, **given)


def test_every_option_of_a_meadow_has_bounds_that_hold_its_default():
    assert set(land.option_bounds(meadow.Options)) == set(meadow.Options.__dataclass_fields__)
    for name, (low, high) in land.option_bounds(meadow.Options).items():
        assert low <= getattr(meadow.Options(), name) <= high
        for value in (low, high):
            land.make_options("meadow", meadow.Options, {name: value})


def test_a_meadow_follows_its_seed():
    one, same, other = grown(3), grown(3), grown(4)
    assert one.places.tobytes() == same.places.tobytes() and one.albedo.tobytes() == same.albedo.tobytes()
    assert (one.plants[0].vertices == same.plants[0].vertices).all()
    assert np.abs(one.ground.vertices - other.ground.vertices).max() > 0.05


def test_the_mean_ground_of_a_meadow_is_at_0_over_the_exemplar():
    vertices = grown(5, undulation=0.3, **BARE).ground.vertices
    over = vertices[np.abs(vertices[:, :2]).max(axis=1) <= 3.0]
    assert over[:, 2].mean() == pytest.approx(0, abs=2e-3)  # two samplings, at 22 and 24 mm, of hummocks of 12 mm
    assert over[:, 2].std() > 0.05


def _fine(made):
    """The vertices of the ground's even middle, as a square."""
    fine = made.ground.vertices[np.abs(made.ground.vertices[:, :2]).max(axis=1) < 3.5]
    side = round(len(fine) ** 0.5)
    return fine.reshape(side, side, 3)


def _heights(made):
    return _fine(made)[..., 2]


def test_plants_stand_on_the_ground():
    made = grown(1, undulation=0.3)
    axis, heights = _fine(made)[0, :, 0], _heights(made)
    near = made.places[np.abs(made.places[:, 1:3]).max(axis=1) < 3.4]
    i, j = (np.searchsorted(axis, near[:, k]) for k in (2, 1))
    corners = np.stack([heights[i - a, j - b] for a in (0, 1) for b in (0, 1)])
    # within a cell of 22 mm the ground is bilinear to the curvature of its hummocks: under 1 mm
    assert len(near) > 300
    assert (near[:, 3] > corners.min(axis=0) - 1e-3).all() and (near[:, 3] < corners.max(axis=0) + 1e-3).all()


def test_mats_of_grass_follow_the_slope_and_tufts_stand_upright():
    made = grown(1, undulation=0.3, clover=0, flowers=0, seed_heads=0)
    tufts = len(made.plants) - 8  # the last kinds: after the mats nothing else grows here
    slope = made.places[:, 6:]
    mats = made.places[:, 0] < 5
    expected = np.hypot(*np.gradient(_heights(made), 0.0219)).mean()
    # the mats' slope is that over half a metre, which leaves the hummocks out, and they stand at other places
    assert np.hypot(*slope[mats].T).mean() == pytest.approx(expected, rel=0.5)
    assert not slope[made.places[:, 0] >= tufts].any()


@pytest.mark.parametrize("name", ["tufts", "seed_heads", "clover", "flowers"])
def test_there_is_as_much_of_a_plant_as_the_options_say(name, monkeypatch):
    monkeypatch.setattr(meadow, "FAR", 16.0)
    none = {key: 0 for key in ("tufts", "seed_heads", "clover", "flowers", "stones", "pebbles")}

    def near(given):
        places = grown(2, **given).places
        return (np.abs(places[:, 1:3]).max(axis=1) < 4.5).sum()  # within 0.4 FAR, where nothing thins out yet

    there = near(none | {name: 200}) - near(none)
    # 162 on 81 square metres, give or take what patches of several metres do, and 8 % by chance
    assert 80 < there < 260


def test_a_bare_meadow_is_all_soil():
    made = grown(0, **BARE)
    assert len(made.places) == 0 and made.stones is None
    assert made.albedo.reshape(-1, 3).mean(axis=0) == pytest.approx(meadow.SOIL, rel=0.05)  # exp of noise: + 2 %


def test_a_meadow_is_greener_where_grass_covers_it():
    camera = camera_layouts.orbit(90, 0, 7.0, (0, 0, 0), 32, 32, 40.0)
    grass, soil = (
        synthetic.render(synthetic.make_scene("meadow", 0, bare=bare, flowers=0), camera, 4).mean(axis=(0, 1))
        for bare in (0, 1)
    )
    assert grass[1] > grass[0] and grass[1] - grass[0] > soil[1] - soil[0] + 0.05


def test_a_picture_of_a_meadow_repeats_to_the_byte_whatever_the_number_of_threads():
    import drjit

    scene, camera = synthetic.make_scene("meadow", 0), pinhole((3.0, -4.0, 1.6), (0.3, 0.2, 0.0), 50, 38, 50.0)
    before = drjit.thread_count()
    try:
        drjit.set_thread_count(1)
        one = synthetic.render(scene, camera, 4)
        drjit.set_thread_count(3)
        synthetic._load_scene.cache_clear()
        three = synthetic.render(scene, camera, 4)
    finally:
        drjit.set_thread_count(before)
    assert one.dtype == np.float32 and one.shape == (38, 50, 3)
    assert one.tobytes() == three.tobytes()
    assert one.min() >= 0 and one.max() <= 1 and one.std() > 0.02


def test_depth_of_a_meadow_ends_on_the_ground_or_on_what_grows_on_it():
    scene, camera = synthetic.make_scene("meadow", 0), pinhole((0.5, -4.0, 3.0), (0, 0, 0), 60, 40, 40.0)
    bare = synthetic.make_scene("meadow", 0, tufts=0, seed_heads=0, clover=0, flowers=0, stones=0, pebbles=0)
    origin, way = camera.rays()
    with_plants, without = (synthetic.render_depth(s, camera) for s in (scene, bare))
    height = (origin + way * with_plants[..., None])[..., 2]
    # the same rolling of 0.13 m below both; nothing grows higher than half a metre, or 1.3 times that with luck
    assert np.isfinite(with_plants).all() and height.min() > -0.6 and height.max() < 1.1
    assert (with_plants < without - 0.05).any()
