"""Sparse models: storing, moving, and points from a part of the images alone."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import (
    colour_points,
    read_colmap_model,
    triangulate_model,
    write_colmap_model,
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
