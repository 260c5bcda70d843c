"""The families of land: that they repeat, where things stand, and what all share."""

from functools import cache

import numpy as np
import pytest

from dav_gswt.photos.synthetic import scene
from dav_gswt.photos.synthetic.land import make_ground_mesh  # as it is before `small_land` replaces it

every_family = pytest.mark.parametrize("name", scene.FAMILIES)


@pytest.fixture(scope="module")
def grown(small_land):
    """Makes the small land of a family once; returns it with its height at places."""

    @cache
    def grow(name):
        return scene.FAMILIES[name].make_land(1, 6.0), small_land[-1]

    return grow


def parts_of(made):
    """All that tells a piece of land from others."""
    yield from (mesh for mesh in (made.ground, made.stones, *made.plants) if mesh)
    yield from (made.places, made.albedo.reshape(-1, 3), [made.period, made.light.elevation, made.light.azimuth])
    yield np.stack([made.light.sun, made.light.zenith, made.light.horizon, made.light.below])
    if made.labels:
        yield made.labels.material.ravel()
        yield from made.labels.objects


@every_family
def test_a_family_follows_its_seed(name, grown, golden):
    golden(name, *parts_of(grown(name)[0]))


@every_family
def test_everything_is_finite_rooted_in_the_ground_and_no_reflectance_leaves_0_to_1(name, grown):
    made, height = grown(name)
    over = np.linspace(-3, 3, 201)
    assert height(*np.meshgrid(over, over)).mean() == pytest.approx(0, abs=3e-3)  # another sampling of the exemplar
    for mesh in [made.ground, *made.plants]:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.colours is None or mesh.colours.min() > 0 and mesh.colours.max() < 1
    assert made.albedo.min() > 0 and made.albedo.max() < 1
    kind, x, y, z, size = made.places.T[:5]
    assert (size > 0).all() and kind.min() >= 0 and kind.max() < len(made.plants)
    if name == "planet":  # no rock floats, and many are half buried
        lowest, highest = np.array([[m.vertices[:, 2].min(), m.vertices[:, 2].max()] for m in made.plants]).T
        ground = height(x, y)
        assert (z + size * lowest[kind.astype(int)] < ground + 5e-3).all()  # flat ones do by up to 2 mm
        assert (z + size * highest[kind.astype(int)] > ground).all() and 0.25 < (z < ground).mean() < 0.75
    else:
        assert z == pytest.approx(height(x, y), abs=1e-9)
        assert all(plant.vertices[:, 2].min() < 0 for plant in made.plants)


def test_the_mesh_of_the_ground_is_fine_about_the_origin_and_faces_up():
    mesh = make_ground_mesh(lambda x, y: 0.1 * x - 0.2 * y)
    x, y, z = mesh.vertices.T.astype(float)
    assert np.allclose(z, 0.1 * x - 0.2 * y, rtol=1e-5, atol=1e-5)
    side = round(len(x) ** 0.5)
    axis, wide = x[:side], np.diff(x[:side])
    assert wide[side // 2] == pytest.approx(0.022, rel=1e-3) and wide.max() == wide[-1] == pytest.approx(wide[0])
    assert axis[-1] == -axis[0] == y.max() == -y.min() and axis[-1] > 500
    a, b, c = (mesh.vertices[mesh.faces[:, i]].astype(float) for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all() and len(mesh.faces) == 2 * (side - 1) ** 2
