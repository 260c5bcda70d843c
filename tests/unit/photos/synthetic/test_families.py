"""Flowers, tall grass, planet and oasis: what they refuse, that they repeat, where things stand, and how they look."""

import zlib
from functools import partial

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.photos.synthetic import (
    flower_plants,
    flowers,
    grass,
    grass_plants,
    land,
    oasis,
    planet,
    rocks,
    scattering,
    scene,
)
from dav_gswt.photos.synthetic.flower_plants import DISCS

pytest.importorskip("mitsuba")
FAMILIES = {"flowers": flowers, "grass": grass, "planet": planet, "oasis": oasis}
BARE = {
    "flowers": {"flowers": 0, "tufts": 0, "stones": 0, "pebbles": 0},
    "grass": {"tussocks": 0, "ears": 0, "docks": 0},
    "planet": {"boulders": 0, "rocks": 0, "stones": 0, "pebbles": 0},
    "oasis": {"flowers": 0, "shrubs": 0, "single_boulders": 0, "stones": 0, "pebbles": 0},
}
every_family = pytest.mark.parametrize("name", FAMILIES)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Ground of few texels and nothing far away: quick to make, and otherwise the same."""
    for family in FAMILIES.values():
        monkeypatch.setattr(family, "TEXELS", 256)
    monkeypatch.setattr(flowers, "NEAR", 4.0)
    monkeypatch.setattr(flowers, "TURFS", ((0.5, 0.0, 4.0, 120, 2),))
    monkeypatch.setattr(flowers, "SWATHES", ((1.4, 4.0, 7.0, 6, 1),))
    for ring, end in {"NEAR": 4.0, "MIDDLE": 6.0, "FAR": 8.0, "REACH": 6.0}.items():
        monkeypatch.setattr(grass, ring, end)
    monkeypatch.setattr(planet, "SORTS", tuple((*span, 8.0, 3, min(fine, 2)) for *span, _, _, fine in planet.SORTS))
    for ring, end in {"NEAR": 4.0, "FAR": 8.0}.items():
        monkeypatch.setattr(oasis, ring, end)
    monkeypatch.setattr(land, "STONE_SQUARE", 7.0)
    yield
    scene._load_scene.cache_clear()


def grown(name, seed=0, **given):
    family = FAMILIES[name]
    return family.make_land(land.make_options(name, family.Options, given), seed, 6.0)


def digest(made):
    """A checksum of all that a piece of land is rendered from."""
    meshes = [made.ground, *made.plants] + ([made.stones] if made.stones else [])
    arrays = [made.albedo, made.places]
    arrays += [part for m in meshes for part in (m.vertices, m.faces, m.colours) if part is not None]
    return [zlib.crc32(np.ascontiguousarray(a).tobytes()) for a in arrays]


def height_at(made, x, y):
    """The ground's height at places within 6.9 m of the origin: bilinear in its even middle."""
    middle = made.ground.vertices[np.abs(made.ground.vertices[:, :2]).max(axis=1) < 6.99]
    side = round(len(middle) ** 0.5)
    grid = middle.reshape(side, side, 3)
    axis = grid[0, :, 0]
    cell = axis[1] - axis[0]
    u, v = (x - axis[0]) / cell, (y - axis[0]) / cell
    c, r = u.astype(int), v.astype(int)
    fu, fv, z = u - c, v - r, grid[..., 2]
    low = z[r, c] * (1 - fu) + z[r, c + 1] * fu
    return low * (1 - fv) + (z[r + 1, c] * (1 - fu) + z[r + 1, c + 1] * fu) * fv


@every_family
def test_every_option_has_bounds_that_hold_its_default(name):
    family = FAMILIES[name]
    assert set(land.option_bounds(family.Options)) == set(family.Options.__dataclass_fields__)
    for option, (low, high) in land.option_bounds(family.Options).items():
        assert low <= getattr(family.Options(), option) <= high
        for value in (low, high):
            land.make_options(name, family.Options, {option: value})


@every_family
def test_what_a_family_cannot_be_is_said_by_name(name):
    for option, (low, high) in land.option_bounds(FAMILIES[name].Options).items():
        for value in (low - 1, high + 1, float("nan"), "many", True):
            with pytest.raises(InputError, match=f"{name}: {option} is .*{low} to {high}"):
                scene.make_scene(name, 0, **{option: value})
    with pytest.raises(InputError, match=f"{name}.*'undulations'.*undulation"):
        scene.make_scene(name, 0, undulations=0.1)


@every_family
def test_a_family_follows_its_seed_to_the_byte(name):
    one, same, other = grown(name, 3), grown(name, 3), grown(name, 4)
    assert digest(one) == digest(same)
    assert np.abs(one.ground.vertices - other.ground.vertices).max() > 0.05
    assert one.places.shape != other.places.shape or np.abs(one.places - other.places).max() > 0.1


@every_family
def test_the_mean_ground_of_the_exemplar_is_at_0(name):
    vertices = grown(name, 5, undulation=0.3, **BARE[name]).ground.vertices
    over = vertices[np.abs(vertices[:, :2]).max(axis=1) <= 3.0]
    assert over[:, 2].mean() == pytest.approx(0, abs=3e-3)  # two samplings, at 22 and 24 mm, of roughness and ripples
    assert over[:, 2].std() > 0.05


@every_family
def test_everything_is_finite_and_no_reflectance_leaves_0_to_1(name):
    made = grown(name, 1)
    for mesh in [made.ground, *made.plants]:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.colours is None or mesh.colours.min() > 0 and mesh.colours.max() < 1
    assert np.isfinite(made.places).all() and (made.places[:, 4] > 0).all()
    assert made.albedo.min() > 0 and made.albedo.max() < 1
    assert made.places[:, 0].min() >= 0 and made.places[:, 0].max() < len(made.plants)


@every_family
def test_extreme_options_still_grow(name):
    family = FAMILIES[name]
    counts = {k: low for k, (low, _) in land.option_bounds(family.Options).items()}
    assert np.isfinite(grown(name, 0, **counts).ground.vertices).all()


@pytest.mark.parametrize("name", ["flowers", "grass", "oasis"])
def test_plants_are_rooted_in_the_ground(name):
    made = grown(name, 2, undulation=0.3)
    near = made.places[np.abs(made.places[:, 1:3]).max(axis=1) < 6.5]
    assert len(near) > 300
    # a cell of 22 mm is bilinear to h^2 k^2 a / 4 = 9 mm for crumbs of amplitude a = 14 mm, 8 cm long (k = 79 / m)
    assert near[:, 3] == pytest.approx(height_at(made, near[:, 1], near[:, 2]), abs=9e-3)
    for plant in made.plants:
        assert plant.vertices[:, 2].min() < 0


def test_no_rock_floats_and_many_are_half_buried():
    made = grown("planet", 2, undulation=0.3)
    near = made.places[np.abs(made.places[:, 1:3]).max(axis=1) < 6.5]
    ground = height_at(made, near[:, 1], near[:, 2])
    lowest = np.array([made.plants[int(k)].vertices[:, 2].min() for k in near[:, 0]])
    highest = np.array([made.plants[int(k)].vertices[:, 2].max() for k in near[:, 0]])
    # 5 mm: the ground's own roughness within one of its cells
    assert (near[:, 3] + near[:, 4] * lowest < ground + 5e-3).all()
    assert (near[:, 3] + near[:, 4] * highest > ground - 5e-3).mean() > 0.97
    assert 0.25 < (near[:, 3] < ground).mean() < 0.75


@pytest.mark.parametrize("name, highest", [("flowers", 1.0), ("grass", 1.2)])
def test_what_grows_hides_the_ground_from_the_side(name, highest):
    camera = camera_layouts.eye_level_camera(0.8, 210.0, 3.8, (0, 0, 0), 48, 27, 60.0)
    origin, way = camera.rays()
    depth = scene.render_depth(scene.make_scene(name, 0), camera)
    seen = (origin + way * depth[..., None])[np.isfinite(depth) & (depth < 5)]
    above = seen[:, 2] - height_at(grown(name), seen[:, 0], seen[:, 1])
    assert (above > 0.1).mean() > 0.3 and above.max() < highest


def test_the_families_look_plausible_and_unlike_each_other():
    camera = camera_layouts.orbit(60, 20, 7.0, (0, 0, 0), 40, 40, 40.0)
    shots = {name: scene.render(scene.make_scene(name, 0), camera, 4) for name in scene.FAMILIES}
    mean = {name: shot.mean(axis=(0, 1)) for name, shot in shots.items()}
    for name, shot in shots.items():
        assert 0.15 < mean[name].mean() < 0.75 and shot.std() > 0.04, name
        for other in mean:
            differs = np.abs(mean[name] - mean[other]).max() + abs(shot.std() - shots[other].std())
            assert other == name or differs > 0.05, (name, other)
    colourful = {name: np.ptp(shot, axis=2).std() for name, shot in shots.items()}
    assert colourful["flowers"] == max(colourful.values())
    assert mean["grass"][1] > mean["grass"][2] + 0.08
    assert mean["oasis"][0] > mean["oasis"][1] > mean["oasis"][2] + 0.03
    assert mean["planet"][0] > 1.3 * mean["planet"][1] > 1.3 * mean["planet"][2]


PLANTS = [
    *(pytest.param(partial(flower_plants.make_bush, kind=kind), id=f"{kind.flower.petals}") for kind in DISCS),
    pytest.param(lambda rng: flower_plants.make_spire(rng, flower_plants.LARKSPUR), id="spire"),
    pytest.param(flower_plants.make_umbel, id="umbel"),
    *(pytest.param(ear, id=ear.__name__) for ear in (*grass_plants.EARS, grass_plants.make_dock)),
    pytest.param(lambda rng: grass_plants.make_tussock(rng, grass_plants.TINTS[0]), id="tussock"),
]


@pytest.mark.parametrize("grow", PLANTS)
def test_a_plant_stands_on_its_root_about_1_high_in_faces_of_one_colour(grow):
    for seed in range(3):
        plant = grow(np.random.default_rng(seed))
        assert 0.5 < plant.vertices[:, 2].max() < 1.6
        assert -0.6 < plant.vertices[:, 2].min() < 0  # leaves may droop below the root, on a slope
        assert np.ptp(plant.colours[plant.faces], axis=1).max() == 0
        assert plant.faces.min() == 0 and plant.faces.max() == len(plant.vertices) - 1


def test_a_stand_leans_with_the_wind_and_flat_grass_lies():
    rng, tint = np.random.default_rng(0), grass_plants.TINTS[1]
    stand, flat = (
        grass_plants.make_stand(rng, 200, 0.9, 0.01, tint),
        grass_plants.make_flat_grass(rng, 200, 0.9, 0.01, tint),
    )
    assert stand.vertices[:, 0].mean() > 0.05 and abs(stand.vertices[:, 1].mean()) < 0.05
    assert stand.vertices[:, 2].max() > 0.8 and flat.vertices[:, 2].max() < 0.35


def test_a_rock_is_closed_and_about_1_across():
    for seed in range(5):
        rock = rocks.make_rock(np.random.default_rng(seed), 2, planet.ROCKS)
        a, b, c = (rock.vertices[rock.faces[:, i]].astype(float) for i in range(3))
        spans = np.ptp(rock.vertices, axis=0)
        assert 0 < (np.cross(a, b) * c).sum() / 6 < np.prod(spans)  # its volume, if closed and outside out
        assert np.cross(b - a, c - a).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-5)  # closed
        assert 0.5 < spans[0] < 1.4
        assert np.ptp(rock.colours[rock.faces], axis=1).max() == 0


def test_a_fresh_crater_has_its_depth_its_rim_and_an_end():
    one, round_ = np.array([[0.5, -0.2, 2.0, 1.0]]), np.zeros((1, 6))
    r = np.array([0.0, 0.5, 1.0, 1.2, 2.0, 3.5, 4.0])
    z = rocks.crater_relief(0.5 + r, np.full(r.shape, -0.2), one, round_)
    assert z[0] == pytest.approx(-2.0 * rocks.DEPTH, rel=1e-6)
    assert z[2:4].max() == pytest.approx(2.0 * rocks.RIM, rel=0.5) and z[2] > z[1]
    assert z[3] > z[4] > 0 and z[5] == z[6] == 0


def test_craters_and_rocks_keep_to_their_sizes():
    rng = np.random.default_rng(0)
    found = rocks.draw_craters(rng, 4000, 20.0, 0.25, 2.5)
    assert found[:, 2].min() >= 0.25 and found[:, 2].max() <= 2.5
    # as many above d as d^-2: a quarter of them above twice the least, but for those beyond the greatest (1 %)
    assert (found[:, 2] > 0.5).mean() == pytest.approx(0.2424, abs=0.025)
    sizes = rocks.draw_sizes(rng, 4000, 0.1, 0.3, 2.2)
    assert sizes.min() >= 0.1 and sizes.max() <= 0.3 and np.median(sizes) < 0.17


def test_patches_hold_their_share_and_mats_leave_no_gap():
    rng = np.random.default_rng(1)
    assert scattering.make_patches(rng, 0.3, 3.0).mean() == pytest.approx(0.3, abs=0.06)
    everywhere = scattering.lay_mats(rng, lambda x, y: np.ones_like(x), (0.0, 4.0), 0.5)
    at = rng.uniform(-2, 2, (500, 2))
    nearest = np.hypot(*(at[:, None] - everywhere[None, :, :2]).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() < 0.5


def test_a_swathe_is_about_1_across_and_as_high_as_its_plants():
    rng = np.random.default_rng(0)
    plants = [flower_plants.make_bush(rng, flower_plants.POPPY) for _ in range(2)]
    made = flower_plants.make_swathe(rng, plants, 20, (0.3, 0.4))
    assert 0.25 < made.vertices[:, 2].max() < 0.55 and np.hypot(*made.vertices[:, :2].T).max() < 1.0
