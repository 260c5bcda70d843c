from dataclasses import fields

import numpy as np

from dav_gswt.field import GaussianField
from dav_gswt.geometry import camera_layouts
from dav_gswt.raster import render
from dav_gswt_study.prior.training import worlds


def same(a: GaussianField, b: GaussianField) -> bool:
    return all(getattr(a, f.name).tobytes() == getattr(b, f.name).tobytes() for f in fields(GaussianField))


def test_a_seed_makes_one_world_which_can_be_drawn_and_fills_a_photo_from_above():
    made = worlds.make_world(3)
    assert same(made.field, worlds.make_world(3).field) and not same(made.field, worlds.make_world(4).field)
    assert 40_000 < len(made.field) < 250_000
    assert all(np.isfinite(getattr(made.field, f.name)).all() for f in fields(GaussianField))
    assert made.field.base_colours.min() >= -1e-6 and made.field.base_colours.max() <= 1 + 1e-6
    seen = render(made.field, camera_layouts.orbit(90, 0, worlds.FLYING_HEIGHT, (0, 0, 0), 64, 64, 55.0))
    assert seen.alpha.min() > 0.95
    assert 0.05 < seen.colour.mean() < 0.9


def sun_at(elevation: float) -> worlds.Light:
    up = np.radians(elevation)
    return worlds.Light(np.array([np.cos(up), 0, np.sin(up)]), np.ones(3), 0.5 * np.ones(3), 0.01)


def flat_with_a_wall():
    """A flat ground with a wall 1 m high along x = 1, at the map's cells."""
    x, _ = worlds.cell_centres()
    return worlds.ShadowMap(np.where(np.abs(x - 1) < 0.1, 1.0, 0.0).astype(np.float32), np.ones(x.shape, np.float32))


def test_a_wall_casts_a_shadow_as_long_as_it_is_high_and_its_foot_sees_less_sky():
    x = np.array([-2.0, -0.5, 0.3, 0.7, 1.5])
    points = np.stack([x, np.zeros(5), np.zeros(5)], 1)
    found = worlds.sun_visibility(sun_at(45), flat_with_a_wall(), points)
    np.testing.assert_allclose(found, [1, 1, 0, 0, 1], atol=0.05)
    seen = worlds.sky_visibility(flat_with_a_wall(), np.array([[0.85, 0, 0], [-3.0, 0, 0], [1.0, 0, 1.0]]))
    assert seen[0] < 0.7
    np.testing.assert_allclose(seen[1:], 1, atol=1e-3)
