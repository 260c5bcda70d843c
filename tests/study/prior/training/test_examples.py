import pickle
from contextlib import suppress
from dataclasses import fields, replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.poses import Pose
from dav_gswt.prior import conditions
from dav_gswt.prior.interface import Condition
from dav_gswt.reconstruction.coarse import StartViews
from dav_gswt.reconstruction.fit_settings import CoarseSettings
from dav_gswt.study.prior.training import example_files, examples

SEED, COUNT = 4, 3


@pytest.fixture(scope="module")
def made():
    return examples.make_examples(SEED, COUNT)


@pytest.fixture
def stored(tmp_path, made):
    path = tmp_path / "part0.npz"
    example_files.write_examples(path, made)
    return path


def same(a, b) -> bool:
    arrays = [[getattr(e.condition, f.name) for f in fields(Condition)] + [e.rgba, e.inverse_depth] for e in (a, b)]
    return all(x.shape == y.shape and x.tobytes() == y.tobytes() for x, y in zip(*arrays, strict=True))


def test_a_seed_makes_the_same_examples(made):
    assert same(made, examples.make_examples(SEED, COUNT))


def test_another_seed_makes_others(made):
    assert not same(made, examples.make_examples(3, COUNT))


def test_examples_are_what_a_prior_takes(made):
    made.condition.check()
    assert len(made) == len(made.condition) == COUNT
    for image in (made.condition.colour, made.condition.alpha, made.condition.photo, made.rgba):
        assert image.min() >= 0 and image.max() <= 1
    assert (made.condition.inverse_depth >= 0).all() and np.isfinite(made.inverse_depth).all()


def test_truth_shows_ground_and_the_fit_resembles_it(made):
    assert (made.rgba[..., 3].mean((1, 2)) >= examples.LEAST_COVER).all()
    both = (made.condition.alpha > 0.95) & (made.rgba[..., 3] > 0.95)
    apart = np.abs(made.condition.colour - made.rgba[..., :3])[both]
    assert both.mean() > 0.2
    assert 0.001 < apart.mean() < 0.15  # neither the truth itself nor another place


def test_depth_and_colour_of_a_disc_straight_below():
    """A wide opaque disc of one colour 3.5 below the camera, flying height 7: inverse depth 2."""
    disc = GaussianField(
        np.zeros((1, 3), np.float32),
        np.log([[50, 50, 0.01]]).astype(np.float32),
        np.float32([[1, 0, 0, 0]]),
        np.float32([8.0]),
        rgb_to_sh(np.array([[0.2, 0.4, 0.6]])),
        np.zeros(1, np.float32),
        np.ones(1, bool),
    )
    seen = conditions.render_view(disc, camera_layouts.orbit(90, 0, 3.5, (0, 0, 0), 8, 8, 55), 7.0)
    np.testing.assert_allclose(seen.inverse_depth, 2, rtol=1e-5)
    np.testing.assert_allclose(seen.alpha, 0.99, atol=1e-3)  # as opaque as one Gaussian gets
    np.testing.assert_allclose(seen.colour, np.broadcast_to(0.99 * np.array([0.2, 0.4, 0.6]), (8, 8, 3)), atol=2e-3)


def test_where_nothing_is_inverse_depth_is_0(made):
    away = camera_layouts.orbit(-90, 0, 5, (0, 0, 20), 8, 8, 55)
    seen = conditions.render_view(examples.make_world(0).field, away, 7.0)
    assert not seen.alpha.any() and not seen.inverse_depth.any()


def test_the_relative_pose_is_from_the_photo_to_the_pose():
    photo, pose = Pose("photo", 60.0, 350.0, 7.0), Pose("pose", 30.0, 20.0, 3.5)
    found = conditions.relative_pose(photo, pose, 7.0)
    np.testing.assert_allclose(found, [-np.pi / 6, 0.5, np.sqrt(3) / 2, -0.5], rtol=1e-6)


def test_the_nearest_photo_is_the_one_whose_camera_is_nearest():
    places = [Pose("above", 90.0, 0.0, 7.0), Pose("west", 20.0, 180.0, 7.0), Pose("east", 20.0, 0.0, 7.0)]
    assert conditions.find_nearest(Pose("", 30.0, 350.0, 6.0), places) == 2
    assert conditions.find_nearest(Pose("", 80.0, 180.0, 6.0), places) == 0


def test_a_camera_inside_a_thing_is_known(made):
    field = examples.make_world(0).field
    assert examples.is_clear(field, camera_layouts.orbit(90, 0, 7.0, (0, 0, 0), 8, 8, 55))
    inside = camera_layouts.orbit(90, 0, 0.1, field.means[0], 8, 8, 55)
    assert not examples.is_clear(field, inside)


@pytest.mark.parametrize("seed", range(20))
def test_a_rig_has_3_to_12_places_above_the_ground(seed):
    rig = examples.draw_rig(np.random.default_rng(seed))
    assert 3 <= len(rig) <= 12
    assert all(30 <= place[0] <= 90 and 6 <= place[2] <= 7.5 for place, _ in rig)


def test_a_turned_camera_stays_where_it_is():
    camera = camera_layouts.orbit(40, 30, 5, (0, 0, 0), 8, 8, 55)
    turned = examples.aim_camera(camera, np.array([1.0, 2.0, 0.0]))
    np.testing.assert_allclose(turned.centre, camera.centre, atol=1e-9)
    towards = np.array([1.0, 2.0, 0.0]) - camera.centre
    np.testing.assert_allclose(turned.forward, towards / np.linalg.norm(towards), atol=1e-9)


def test_stored_examples_come_back_to_the_bytes_precision(stored, made):
    again = example_files.read_examples(stored)
    np.testing.assert_allclose(again.rgba, made.rgba, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(again.condition.colour, made.condition.colour, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(again.inverse_depth, made.inverse_depth, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(again.condition.relative, made.condition.relative, rtol=1e-3, atol=1e-4)
    assert stored.stat().st_size < 100_000 * COUNT


def test_a_file_has_the_same_bytes_every_time(stored, tmp_path, made):
    example_files.write_examples(tmp_path / "again.npz", made)
    assert stored.read_bytes() == (tmp_path / "again.npz").read_bytes()


def test_no_examples_can_be_stored_and_joined(tmp_path, made):
    example_files.write_examples(tmp_path / "none.npz", example_files.empty_examples())
    assert len(example_files.read_examples(tmp_path / "none.npz")) == 0
    assert same(example_files.concatenate([example_files.empty_examples(), made]), made)


def broken(stored, name, value):
    with np.load(stored) as file:
        arrays = dict(file)
    if value is None:
        del arrays[name]
    else:
        arrays[name] = value(arrays[name])
    np.savez_compressed(stored, **arrays)


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("photo", None, "photo is missing"),
        ("alpha", lambda a: a[:, :32], "alpha is"),
        ("rgba", lambda a: a[:-1], "rgba is"),
        ("colour", lambda a: a.astype(np.float32), "colour is float32"),
        ("relative", lambda a: np.float16(0), "relative is"),
        ("relative", lambda a: np.full_like(a, np.nan), "relative holds numbers that are not finite"),
        ("photo", lambda a: np.array([{}]), "photo is object"),
    ],
)
def test_wrong_arrays_are_refused_by_name(stored, name, value, message):
    broken(stored, name, value)
    with pytest.raises(InputError, match=message):
        example_files.read_examples(stored)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_file_cut_short_is_refused(stored, share):
    whole = stored.read_bytes()
    stored.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match="not readable as examples"):
        example_files.read_examples(stored)


def test_a_pickle_is_never_read(tmp_path):
    path = tmp_path / "part0.npz"
    path.write_bytes(pickle.dumps({"colour": 1}))
    with pytest.raises(InputError, match="not readable as examples"):
        example_files.read_examples(path)
    with pytest.raises(InputError, match="not readable as examples"):
        example_files.read_examples(tmp_path / "missing.npz")


def test_damaged_bytes_are_refused_or_give_whole_examples(stored):
    whole, rng = stored.read_bytes(), np.random.default_rng(0)
    for at in rng.integers(0, len(whole), 60):
        stored.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        with suppress(InputError):
            assert len(example_files.read_examples(stored)) == COUNT


def test_what_is_not_finite_is_not_written(tmp_path, made):
    bad = replace(made, condition=replace(made.condition, relative=np.full((COUNT, 4), np.nan, np.float32)))
    with pytest.raises(ValueError, match="relative of view 0"):
        example_files.write_examples(tmp_path / "bad.npz", bad)


def test_a_fit_stays_under_its_cap(monkeypatch):
    """The cap is what bounds the seconds of a fit."""
    seen = []

    def fit(given: StartViews, quality: CoarseSettings, rng):
        seen.append((quality, len(given.points), len(given.views), given.frame.extent.east))
        raise InterruptedError

    monkeypatch.setattr(examples, "fit_coarse_field", fit)
    with pytest.raises(InterruptedError):
        examples.make_examples(7, 1)
    quality, points, photos, east = seen[0]
    assert quality.max_gaussians <= 50_000 and quality.steps <= 90 and quality.size in examples.PHOTO_SIZES
    assert 3 <= photos <= 12 and 50 < points < 2000 and 3 < east < 6
