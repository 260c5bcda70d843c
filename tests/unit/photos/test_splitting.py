"""Start views, pool and test views, and views.json, which names them."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.photos import view_split
from dav_gswt.photos.view_split import (
    measure_visible_share,
    split_views,
)

FRAME = scene_frame(exemplar=(-0.6, -0.6, 1.2))


@pytest.fixture
def flown():
    """Thirty photos in six flight lines of five."""
    return synth.model(synth.flight(6, 5), synth.plain(1500, 1.2, np.random.default_rng(1)))


def first(model, count):
    """The model of the first photos of a model."""
    keep = model.image_of < count
    return synth.model(list(model.cameras[:count]), model.points) if keep.any() else model


def split(model, seed=0, start=8, frame=FRAME, test=None):
    return split_views(model, frame, np.random.default_rng(seed), start, test)


@pytest.mark.parametrize(
    "photos, start, pool, test",
    [(3, 3, 0, 0), (6, 6, 0, 0), (11, 8, 3, 0), (12, 8, 3, 1), (20, 8, 10, 2), (30, 8, 19, 3)],
)
def test_every_photo_has_one_part_of_its_size(flown, photos, start, pool, test):
    model = first(flown, photos)
    parts = split(model)
    assert (len(parts.start), len(parts.pool), len(parts.test)) == (start, pool, test)
    assert sorted(parts.start + parts.pool + parts.test) == sorted(model.names)


def test_all_photos_start_and_as_many_test_as_are_asked_for(flown):
    parts = split(first(flown, 8), start=None, test=2)
    assert (len(parts.start), len(parts.pool), len(parts.test)) == (6, 0, 2)
    assert len(split(flown, start=None, test=0).start) == 30
    with pytest.raises(InputError, match="test: 7 of 8 photos.*2 must be left"):
        split(first(flown, 8), test=7)


def test_test_views_are_the_same_for_every_seed_and_start_views_are_not(flown):
    parts = [split(flown, seed) for seed in range(5)]
    assert all(p.test == parts[0].test for p in parts)
    assert len({tuple(p.start) for p in parts}) > 1
    assert split(flown, 3) == split(flown, 3)


def test_photos_of_other_ground_take_no_part_and_are_counted(flown, caplog):
    """An exemplar in one corner: photos of the opposite corner do not see it."""
    frame = scene_frame(exemplar=(-0.9, -0.9, 0.6))
    parts = split(flown, start=4, frame=frame)
    named = [name for part in astuple(parts) for name in part]
    assert 6 <= len(named) < 30
    assert caplog.messages == [
        f"{30 - len(named)} of 30 photos show little of the ground that counts, and take no part"
    ]
    ground = (-0.9, -0.9, -0.3, -0.3)
    assert all(measure_visible_share(flown.camera(n), ground) >= view_split.MIN_VISIBLE_SHARE for n in named)


def test_the_test_views_that_ground_json_names_are_taken_or_refused(flown):
    parts = split(flown, frame=replace(FRAME, test=("003.png", "017.png")))
    assert parts.test == ("003.png", "017.png")
    assert not set(parts.test) & set(parts.start + parts.pool)
    with pytest.raises(InputError, match="nowhere.png"):
        split(flown, frame=replace(FRAME, test=("nowhere.png",)))
    with pytest.raises(InputError, match="every image is a test view"):
        split(flown, frame=replace(FRAME, test=flown.names))
