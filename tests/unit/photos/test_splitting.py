"""Start views, pool and test views."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.photos import splitting
from dav_gswt.photos.splitting import find_aim_point, ground_bounds, measure_visible_share, shows_enough, split_views

FRAME = scene_frame(exemplar=(-0.6, -0.6, 1.2))


@pytest.fixture
def flown():
    """Thirty photos in six flight lines of five."""
    return synth.model(synth.flight(6, 5), synth.plain(4000, 1.2, np.random.default_rng(1)))


def first(model, count):
    """The model of the first photos of a model."""
    keep = model.image_of < count
    return synth.model(list(model.cameras[:count]), model.points) if keep.any() else model


def split(model, seed=0, start=8, frame=FRAME):
    return split_views(model, frame, start, np.random.default_rng(seed))


@pytest.mark.parametrize("photos", [3, 5, 6, 8, 9, 12, 30])
def test_every_photo_has_one_part(flown, photos):
    model = first(flown, photos)
    parts = split(model)
    together = parts.start + parts.pool + parts.test
    assert sorted(together) == sorted(model.names)


@pytest.mark.parametrize(
    "photos, start, pool, test",
    [(3, 3, 0, 0), (5, 5, 0, 0), (6, 4, 0, 2), (8, 6, 0, 2), (10, 8, 0, 2), (12, 8, 2, 2), (30, 8, 19, 3)],
)
def test_how_many_photos_each_part_gets(flown, photos, start, pool, test):
    parts = split(first(flown, photos))
    assert (len(parts.start), len(parts.pool), len(parts.test)) == (start, pool, test)


def test_test_views_are_the_same_for_every_seed_and_start_views_are_not(flown):
    parts = [split(flown, seed) for seed in range(5)]
    assert all(p.test == parts[0].test for p in parts)
    assert len({tuple(p.start) for p in parts}) > 1
    assert split(flown, 3) == split(flown, 3)


def test_test_views_look_at_the_inner_exemplar_and_stay_apart(flown):
    chosen = [flown.camera(name) for name in split(flown).test]
    aims = np.array([find_aim_point(camera) for camera in chosen])
    assert np.abs(aims).max() <= 0.6 * 0.5**0.5
    apart = np.linalg.norm(aims[:, None] - aims[None], axis=2)[~np.eye(len(aims), dtype=bool)]
    assert apart.min() > 0.25  # more than the step between neighbours in a flight line


def test_start_views_are_connected_by_points(flown):
    """Whatever the seed, each start view shares enough points with one chosen before it."""
    sees = [set(flown.point_of[flown.image_of == i]) for i in range(30)]
    for seed in range(8):
        start = [flown.names.index(name) for name in split(flown, seed).start]
        for k in range(1, len(start)):
            assert max(len(sees[start[k]] & sees[j]) for j in start[:k]) >= splitting.LINK


def test_start_views_are_more_spread_than_random_ones(flown):
    def spread(names):
        centres = np.array([flown.camera(name).centre for name in names])
        apart = np.linalg.norm(centres[:, None] - centres[None], axis=2) + np.eye(len(names)) * 9
        return apart.min()

    rng = np.random.default_rng(0)
    ours = np.mean([spread(split(flown, seed).start) for seed in range(10)])
    random = np.mean([spread(rng.choice(flown.names, 8, replace=False)) for _ in range(50)])
    assert ours > 1.2 * random


def test_photos_that_share_no_points_still_all_start():
    cameras = [synth.camera((3.0 * i, 0, 1)) for i in range(4)]
    points = np.concatenate([synth.plain(50, 0.3, np.random.default_rng(i)) + [3.0 * i, 0, 0] for i in range(4)])
    assert len(split(synth.model(cameras, points)).start) == 4


def test_photos_of_other_ground_take_no_part(flown):
    """An exemplar in one corner: photos of the opposite corner do not see it."""
    frame = scene_frame(exemplar=(-0.9, -0.9, 0.6))
    parts = split(flown, start=4, frame=frame)
    named = [name for part in astuple(parts) for name in part]
    assert 6 <= len(named) < 30
    assert all(
        measure_visible_share(flown.camera(name), ground_bounds(frame, whole=False)) >= splitting.MIN_VISIBLE_SHARE
        for name in named
    )


def test_sight_is_the_share_of_the_square_by_hand():
    # From height 1 the picture covers 320 / 300 by 240 / 300 of ground, centred under the camera.
    camera = synth.camera((0, 0, 1))
    assert measure_visible_share(camera, (-0.3, -0.3, 0.3, 0.3)) == 1
    assert measure_visible_share(camera, (0.0, -0.4, 0.8, 0.4)) == pytest.approx(160 / 300 / 0.8, abs=1 / 16)
    assert measure_visible_share(camera, (5.0, 5.0, 6.0, 6.0)) == 0


def test_the_test_views_that_ground_json_names_are_taken(flown):
    parts = split(flown, frame=replace(FRAME, test=("003.png", "017.png")))
    assert parts.test == ("003.png", "017.png")
    assert not set(parts.test) & set(parts.start + parts.pool)


def test_a_named_test_view_that_is_no_image_is_refused(flown):
    with pytest.raises(InputError, match="nowhere.png"):
        split(flown, frame=replace(FRAME, test=("nowhere.png",)))
    with pytest.raises(InputError, match="every image is a test view"):
        split(flown, frame=replace(FRAME, test=flown.names))


def test_photos_of_all_ground_take_part_where_all_of_it_is_in_question(flown):
    """The same corner, but every photo sees some of the whole; tests are spread over the whole, too."""
    frame = scene_frame(exemplar=(-0.9, -0.9, 0.6), extent=(-1.2, -1.2, 1.2, 1.2))
    parts = split_views(flown, frame, 4, np.random.default_rng(0), whole=True)
    assert sum(len(part) for part in astuple(parts)) == 30
    aims = np.array([find_aim_point(flown.camera(name)) for name in parts.test])
    assert np.ptp(aims[:, 0]) > 0.6


def test_a_picture_that_shows_little_else_takes_part_however_wide_the_ground_is():
    camera = synth.camera((0.0, 0.0, 1.0), (0.0, 1e-3, 0.0))
    wide, narrow = (-9.0, -9.0, 9.0, 9.0), (0.4, 0.4, 9.0, 9.0)
    assert measure_visible_share(camera, wide) < splitting.MIN_VISIBLE_SHARE
    assert shows_enough(camera, wide) and not shows_enough(camera, narrow)
    assert not shows_enough(synth.camera((0.0, 0.0, 1.0), (0.0, 1e-3, 2.0)), wide), "it looks at the sky"


def test_with_many_to_start_from_photos_of_other_ground_stay_out():
    """A road that is longer than the exemplar, and a start of more photos than there are."""
    cameras = synth.flight(2, 5, step=0.2) + [synth.camera((5.0 + i, 0, 1), (5.0 + i, 1e-3, 0)) for i in range(20)]
    model = synth.model(cameras, synth.plain(500, 0.6, np.random.default_rng(1)))
    parts = split(model, start=1000, frame=scene_frame(exemplar=(-0.5, -0.5, 1.0)))
    assert len(parts.start) + len(parts.test) == 10 and not parts.pool
