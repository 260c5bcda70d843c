"""Sparse models: storing, moving, points from a part of the images alone; start views, pool and test views."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos import view_split
from dav_gswt.photos.colmap_model import (
    colour_points,
    read_colmap_model,
    triangulate_model,
    write_colmap_model,
)
from dav_gswt.photos.view_split import (
    measure_visible_share,
    split_views,
)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.fixture
def flown(rng):
    """Nine photos of 300 points near the ground, matched exactly."""
    return synth.model(synth.flight(3, 3), synth.plain(300, 0.7, rng, relief=0.05))


def test_points_do_not_change_when_other_images_change(flown, rng):
    """The leak test: whatever images outside the list saw, and what all images made of it, leaves no trace."""
    names = flown.names[:4]
    outside = flown.image_of >= 4
    pixels = flown.pixels.copy()
    pixels[outside] += rng.normal(0, 50, (outside.sum(), 2))
    other = replace(flown, pixels=pixels, points=flown.points + 1.0, colours=1 - flown.colours)
    one, two = triangulate_model(flown, names), triangulate_model(other, names)
    assert np.array_equal(one.points, two.points) and np.array_equal(one.colours, two.colours)


def test_colours_come_from_the_named_images_alone(flown, tmp_path):
    for i, name in enumerate(flown.names):
        image_files.write_png(tmp_path / name, np.full((synth.HEIGHT, synth.WIDTH, 3), 0.2 if i < 3 else 1.0))
    part = triangulate_model(flown, flown.names[:3])
    colours = colour_points(part, [tmp_path / name for name in part.names])
    assert colours == pytest.approx(np.full(colours.shape, 0.2), abs=1e-6)


def test_a_model_comes_back_from_disk_as_it_was(flown, tmp_path):
    write_colmap_model(flown, tmp_path)
    back = read_colmap_model(tmp_path)
    assert back.names == flown.names
    assert np.array_equal(back.points, flown.points) and np.array_equal(back.point_of, flown.point_of)
    assert back.colours == pytest.approx(flown.colours, abs=0.51 / 255)  # stored in 8 bits
    assert np.array_equal(back.pixels, flown.pixels) and np.array_equal(back.image_of, flown.image_of)
    for a, b in zip(back.cameras, flown.cameras, strict=True):
        assert (a.fx, a.fy, a.cx, a.cy, a.width, a.height) == (b.fx, b.fy, b.cx, b.cy, b.width, b.height)
        assert a.rotation == pytest.approx(b.rotation, abs=1e-14)  # goes through a quaternion
        assert a.translation == pytest.approx(b.translation, abs=1e-14)


def test_a_missing_or_damaged_model_is_refused_by_name(flown, tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        read_colmap_model(tmp_path / "nowhere")
    write_colmap_model(flown, tmp_path)
    (tmp_path / "images.bin").write_bytes((tmp_path / "images.bin").read_bytes()[:100])
    with pytest.raises(InputError, match=tmp_path.name):
        read_colmap_model(tmp_path)


FRAME = scene_frame(exemplar=(-0.6, -0.6, 1.2))


@pytest.fixture
def thirty():
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
def test_every_photo_has_one_part_of_its_size(thirty, photos, start, pool, test):
    model = first(thirty, photos)
    parts = split(model)
    assert (len(parts.start), len(parts.pool), len(parts.test)) == (start, pool, test)
    assert sorted(parts.start + parts.pool + parts.test) == sorted(model.names)


def test_all_photos_start_and_as_many_test_as_are_asked_for(thirty):
    parts = split(first(thirty, 8), start=None, test=2)
    assert (len(parts.start), len(parts.pool), len(parts.test)) == (6, 0, 2)
    assert len(split(thirty, start=None, test=0).start) == 30
    with pytest.raises(InputError, match="test: 7 of 8 photos.*2 must be left"):
        split(first(thirty, 8), test=7)


def test_test_views_are_the_same_for_every_seed_and_start_views_are_not(thirty):
    parts = [split(thirty, seed) for seed in range(5)]
    assert all(p.test == parts[0].test for p in parts)
    assert len({tuple(p.start) for p in parts}) > 1
    assert split(thirty, 3) == split(thirty, 3)


def test_photos_of_other_ground_take_no_part_and_are_counted(thirty, caplog):
    """An exemplar in one corner: photos of the opposite corner do not see it."""
    frame = scene_frame(exemplar=(-0.9, -0.9, 0.6))
    parts = split(thirty, start=4, frame=frame)
    named = [name for part in astuple(parts) for name in part]
    assert 6 <= len(named) < 30
    assert caplog.messages == [
        f"{30 - len(named)} of 30 photos show little of the ground that counts, and take no part"
    ]
    ground = (-0.9, -0.9, -0.3, -0.3)
    assert all(measure_visible_share(thirty.camera(n), ground) >= view_split.MIN_VISIBLE_SHARE for n in named)


def test_the_test_views_that_ground_json_names_are_taken_or_refused(thirty):
    parts = split(thirty, frame=replace(FRAME, test=("003.png", "017.png")))
    assert parts.test == ("003.png", "017.png")
    assert not set(parts.test) & set(parts.start + parts.pool)
    with pytest.raises(InputError, match="nowhere.png"):
        split(thirty, frame=replace(FRAME, test=("nowhere.png",)))
    with pytest.raises(InputError, match="every image is a test view"):
        split(thirty, frame=replace(FRAME, test=thirty.names))
