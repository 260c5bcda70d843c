"""Synthetic land: families, meshes and random fields follow their seed, whatever the threads."""

from functools import cache, partial

import numpy as np
import pytest

from dav_gswt.photos.synthetic import desert, meshes, noise, planet, plants, scene
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


PLANTS = {
    "shrub": plants.make_shrub,
    "dry tuft": plants.make_dry_tuft,
    "tuft": plants.make_tuft,
    "seed grass": plants.make_seed_grass,
    "clover": plants.make_clover,
}
PLANTS |= {f"flower {k}": partial(plants.make_flower, kind=f) for k, f in enumerate(plants.MEADOW_FLOWERS)}
PLANTS |= {"bush": partial(plants.make_flower, kind=plants.MEADOW_FLOWERS[0], most=9)}
STONES = {
    "stone": partial(meshes.make_stone, subdivisions=2, palette=desert.STONES),
    "rock": partial(meshes.make_rock, subdivisions=2, palette=planet.ROCKS),
}
MATS = {
    "mat": partial(plants.make_mat, count=40, length=0.12, dry=0.2),
    "stand": partial(plants.make_stand, count=40, length=0.9, width=0.01, tint=plants.TINTS[1]),
    "swathe": lambda rng: plants.make_swathe(rng, [PLANTS["flower 3"](rng) for _ in range(2)], 4, (0.3, 0.4)),
}
EVERY = PLANTS | STONES | MATS


@pytest.mark.parametrize("name", EVERY)
def test_a_mesh_is_that_of_its_seed(name, golden):
    golden(name, *(EVERY[name](np.random.default_rng(seed)) for seed in (1, 2)))


def test_a_ripple_has_its_profile(golden):
    phase = np.linspace(-np.pi, np.pi, 2001)
    golden("ripple profile", noise.ripple_profile(phase))


@pytest.mark.parametrize(
    "draw",
    [
        lambda rng: noise.make_noise(rng, 64, 4.0, 1.0, 0.2, 1.0),
        lambda rng: np.stack(noise.make_ripples(rng, 64, 4.0, 0.3, 0.5)),
    ],
)
def test_a_raster_is_the_same_on_any_number_of_threads(monkeypatch, draw):
    found = []
    for threads in ("1", "3"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(draw(np.random.default_rng(3)))
    assert np.array_equal(*found)
