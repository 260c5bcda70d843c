"""The cells of a finite terrain, and what is said before work starts."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.export import terrain_files
from dav_gswt.export.formats import EXPORTERS
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
    assert terrain_files.choose_area({"columns": 3, "rows": 2} | place) == expected


def plan(terrain, settings, **changes):
    return terrain_files.plan_export(terrain, settings | changes, 0.5)


def test_the_eye_stands_on_the_surface_and_the_origin_is_the_middle(cover_terrain, export_settings):
    wanted = plan(cover_terrain, export_settings, centre=[4.2, 3.0])
    side = cover_terrain.side
    ground = cover_terrain.heights.at(np.array([4.2 * side]), np.array([3.0 * side]))[0][0]
    np.testing.assert_allclose(wanted.eye, [4.2 * side, 3 * side, ground + 0.5])
    np.testing.assert_allclose(wanted.origin, [4.5 * side, 3 * side, 0])


@pytest.mark.parametrize("level, name, limit", [(0, "spz", 20_000), (1, "glb", None), ("by_distance", "usd", None)])
def test_too_much_is_refused_with_how_much_smaller_it_must_be(cover_terrain, export_settings, level, name, limit):
    each = replace(EXPORTERS[name], bytes=1, gaussians=limit) if limit else EXPORTERS[name]

    def check(bound, columns=40, **place):
        wanted = plan(cover_terrain, export_settings, columns=columns, rows=20, level=level, **place)
        terrain_files.check_size(cover_terrain, wanted, {name: each}, 1.0 if limit else 1e-9 * bound * each.bytes)

    with pytest.raises(
        InputError, match=rf"export: {name}: 40 x 20 cells have up to \d+ Gaussians, .* 20000; "
    ) as told:
        check(20_000)
    count, share = (int(found) for found in re.search(r"up to (\d+) .* to about (\d+)% of", str(told.value)).groups())
    assert share == round(100 * (20_000 / count) ** 0.5) and "set export.columns and export.rows to" in str(told.value)
    check(20_000, columns=1)
    if not limit:
        check(count)
        with pytest.raises(InputError, match=f"{count} Gaussians, export.max_gb"):
            check(count - 1)


def test_a_level_that_is_not_there_is_named(cover_terrain, export_settings):
    with pytest.raises(InputError, match=r"export\.level: there is no level 2; the last one is 1"):
        plan(cover_terrain, export_settings, level=2)


@pytest.mark.parametrize("name", [name for name, each in EXPORTERS.items() if each.all_levels])
def test_a_set_of_all_levels_is_counted_by_the_finest(cover_terrain, export_settings, name):
    coarse, both = plan(cover_terrain, export_settings, level=1), {key: EXPORTERS[key] for key in ("ply", name)}
    count = int(finite.count_cells(finite.keep_level(cover_terrain, 0), coarse.area, coarse.eye).sum())
    terrain_files.check_size(cover_terrain, coarse, both, 1e-9 * (count + 0.5) * both[name].bytes)
    with pytest.raises(InputError, match=rf"export: {name}: 3 x 2 cells have up to {count} Gaussians"):
        terrain_files.check_size(cover_terrain, coarse, both, 1e-9 * (count - 0.5) * both[name].bytes)


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


def test_a_radius_that_is_too_large_is_refused(cover_terrain, export_settings):
    wanted = plan(cover_terrain, export_settings, radius=12.0)
    with pytest.raises(InputError, match=r"ply: a radius of 12 tiles has up to .*; set export\.radius to about \d+%"):
        terrain_files.check_size(cover_terrain, wanted, {"ply": EXPORTERS["ply"]}, 20_000e-9 * 68)


@pytest.mark.parametrize(
    "given, metres, said",
    [
        ({"radius": "6m"}, None, r"export\.radius: 6m: the scale of this terrain is not known"),
        ({"centre": [0.0, "1m"]}, None, r"export\.centre: 1m: the scale of this terrain is not known"),
        ({"radius": "6000m"}, 1.0, r"export\.radius: 1500 tile sides; 0.000001 to 500"),
        ({"radius": "0m"}, 1.0, r"export\.radius: 0 tile sides"),
        ({"radius": 1e-17, "centre": [3.0, 3.0]}, None, r"export\.radius: 1e-17 tile sides"),
        ({"centre": ["99999999999m", 0.0]}, 1.0, r"export\.centre lies beyond"),
    ],
)
def test_metres_become_tile_sides_and_lengths_that_make_no_sense_are_refused(given, metres, said):
    sound = {"centre": ["-3m", 2.0], "radius": "6 m", "level": 0}
    found = terrain_files.resolve_lengths(sound, side=4.0, metres=0.5)
    assert found == {"centre": [-1.5, 2.0], "radius": 3.0, "level": 0}
    with pytest.raises(InputError, match=said):
        terrain_files.resolve_lengths(given, 4.0, metres)
