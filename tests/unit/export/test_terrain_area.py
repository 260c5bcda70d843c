"""The cells of a finite terrain, and what is said before work starts."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.export import terrain_area
from dav_gswt.terrain import finite
from dav_gswt.terrain.finite import Area, Disc


@pytest.mark.parametrize(
    "place, expected",
    [
        ({}, (Area(-1, -1, 3, 2), (0.0, 0.0))),
        ({"centre": [10.5, -4.0]}, (Area(9, -5, 3, 2), (10.5, -4.0))),
        ({"centre": [3.9, -0.5], "columns": 5}, (Area(1, -1, 5, 2), (3.9, -0.5))),
        ({"corner": [7, -3]}, (Area(7, -3, 3, 2), (8.5, -2.0))),
    ],
)
def test_cells_lie_about_the_centre_or_from_the_corner(place, expected):
    assert terrain_area.choose_area({"columns": 3, "rows": 2} | place) == expected


def limits(name):
    return {name: terrain_area.LIMITS[name]}


def plan(terrain, settings, **changes):
    return terrain_area.plan_export(terrain, settings | changes, 0.5)


def test_the_eye_stands_on_the_surface_and_the_origin_is_the_middle(cover_terrain, export_settings):
    wanted = plan(cover_terrain, export_settings, centre=[4.2, 3.0])
    side = cover_terrain.side
    ground = cover_terrain.heights.at(np.array([4.2 * side]), np.array([3.0 * side]))[0][0]
    np.testing.assert_allclose(wanted.eye, [4.2 * side, 3 * side, ground + 0.5])
    np.testing.assert_allclose(wanted.origin, [4.5 * side, 3 * side, 0])


@pytest.mark.parametrize("level, name, limit", [(0, "spz", 20_000), (1, "glb", None), ("by_distance", "usd", None)])
def test_too_much_is_refused_with_the_area_that_fits(cover_terrain, export_settings, monkeypatch, level, name, limit):
    if limit:
        monkeypatch.setitem(terrain_area.LIMITS, name, terrain_area.FileLimit(1, limit))
    max_gb = 1.0 if limit else 1e-9 * 20_000 * terrain_area.LIMITS[name].bytes

    def check(columns, rows):
        wanted = plan(cover_terrain, export_settings, columns=columns, rows=rows, level=level)
        return terrain_area.check_size(cover_terrain, wanted, limits(name), max_gb)[name]

    with pytest.raises(
        InputError, match=rf"export: {name}: 40 x 20 cells have up to \d+ Gaussians, .* 20000; "
    ) as told:
        check(40, 20)
    columns, rows = map(int, re.search(r"; (\d+) x (\d+) fit", str(told.value)).groups())
    assert 0 < check(columns, rows) <= 20_000
    with pytest.raises(InputError):
        check(columns + 4, rows + 4)


def test_a_level_that_is_not_there_and_a_limit_below_one_cell_are_named(cover_terrain, export_settings):
    with pytest.raises(InputError, match=r"export\.level: there is no level 2; the last one is 1"):
        plan(cover_terrain, export_settings, level=2)
    with pytest.raises(InputError, match="not one cell fits: set export.level to a coarser one, or raise"):
        terrain_area.check_size(cover_terrain, plan(cover_terrain, export_settings), limits("ply"), 1e-6)


@pytest.mark.parametrize("name", sorted(terrain_area.ALL_LEVELS))
def test_a_set_of_all_levels_is_counted_by_the_finest(cover_terrain, export_settings, name):
    coarse, both = plan(cover_terrain, export_settings, level=1), limits("ply") | limits(name)
    counts = terrain_area.check_size(cover_terrain, coarse, both, 1.0)
    assert counts["ply"] < counts[name]
    assert counts[name] == terrain_area.check_size(cover_terrain, replace(coarse, level=0), limits("ply"), 1.0)["ply"]
    said = terrain_area.describe_size(counts, both)
    assert f"ply {counts['ply']} Gaussians" in said and f"{name} (finest level) {counts[name]} Gaussians" in said
    bound = 1e-9 * (counts[name] - 1) * terrain_area.LIMITS[name].bytes
    with pytest.raises(InputError, match=rf"export: {name}: 3 x 2 cells have up to {counts[name]} Gaussians"):
        terrain_area.check_size(cover_terrain, coarse, limits(name), bound)
    assert said.endswith(f"{counts[name] * 56 / 1e6:.0f} MB of disk on the way")


def test_a_radius_takes_all_cells_that_it_touches(cover_terrain, export_settings):
    wanted = plan(cover_terrain, export_settings, centre=[0.25, 3.0], radius=1.5)
    assert wanted.area == Area(-2, 1, 4, 4, Disc(0.25, 3.0, 1.5))
    i, j = (v.ravel() for v in np.meshgrid(np.arange(-5, 9), np.arange(-5, 9)))
    x, y = np.random.default_rng(0).uniform(-1.5, 1.5, (2, 5000))
    inside = np.hypot(x, y) < 1.5
    found = set(zip(*(np.floor(v).astype(int).tolist() for v in (0.25 + x[inside], 3.0 + y[inside])), strict=True))
    touched = wanted.area.disc.touches(i, j)
    assert set(zip(i[touched].tolist(), j[touched].tolist(), strict=True)) == found
    assert len(finite.list_grid(cover_terrain, wanted.area, wanted.eye)) == len(found)


def test_a_radius_that_is_too_large_is_refused_with_the_one_that_fits(cover_terrain, export_settings):
    def check(radius):
        wanted = plan(cover_terrain, export_settings, radius=radius)
        return terrain_area.check_size(cover_terrain, wanted, limits("ply"), 20_000e-9 * 68)["ply"]

    with pytest.raises(InputError, match=r"ply: a radius of 12 tiles has up to \d+ Gaussians") as told:
        check(12.0)
    fits = float(re.search(r"; ([\d.]+) tiles fit: set export\.radius", str(told.value))[1])
    assert check(fits) <= 20_000
    with pytest.raises(InputError):
        check(fits + 1)


@pytest.mark.parametrize(
    "given, metres, said",
    [
        ({"radius": "6m"}, None, r"export\.radius: 6m: the scale of this terrain is not known"),
        ({"centre": [0.0, "1m"]}, None, r"export\.centre: 1m: the scale of this terrain is not known"),
        ({"radius": "6000m"}, 1.0, r"export\.radius: 1500 tile sides; more than 0 and at most 500"),
        ({"radius": "0m"}, 1.0, r"export\.radius: 0 tile sides"),
        ({"radius": 1e-17, "centre": [3.0, 3.0]}, None, r"export\.radius: 1e-17 tile sides touch no cell"),
        ({"centre": ["99999999999m", 0.0]}, 1.0, r"export\.centre lies beyond"),
    ],
)
def test_metres_become_tile_sides_and_lengths_that_make_no_sense_are_refused(given, metres, said):
    sound = {"centre": ["-3m", 2.0], "radius": "6 m", "level": 0}
    found = terrain_area.resolve_lengths(sound, side=4.0, metres=0.5)
    assert found == {"centre": [-1.5, 2.0], "radius": 3.0, "level": 0}
    with pytest.raises(InputError, match=said):
        terrain_area.resolve_lengths(given, 4.0, metres)
