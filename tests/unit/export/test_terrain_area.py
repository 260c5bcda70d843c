"""The cells of a finite terrain, and what is said before work starts."""

import re

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
        ({"corner": [7, -3]}, (Area(7, -3, 3, 2), (8.5, -2.0))),
    ],
)
def test_cells_lie_about_the_centre_or_from_the_corner(place, expected):
    assert terrain_area.choose_area({"columns": 3, "rows": 2} | place) == expected


@pytest.mark.parametrize("centre", [-0.5, 0.0, 0.3, 0.5, 3.9])
@pytest.mark.parametrize("columns", [1, 2, 5])
def test_the_centre_is_in_the_middle_of_the_area_to_half_a_cell(centre, columns):
    area, _ = terrain_area.choose_area({"columns": columns, "rows": 1, "centre": [centre, 0.0]})
    assert abs(area.west + columns / 2 - centre) <= 0.5


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


def test_a_level_that_is_not_there_is_named(cover_terrain, export_settings):
    with pytest.raises(InputError, match=r"export\.level: there is no level 2; the last one is 1"):
        plan(cover_terrain, export_settings, level=2)


@pytest.mark.parametrize("level", [0, 1, "by_distance"])
@pytest.mark.parametrize("name, limit", [("ply", None), ("glb", None), ("usd", None), ("spz", 20_000)])
def test_too_much_is_refused_with_the_area_that_fits(cover_terrain, export_settings, monkeypatch, level, name, limit):
    given = export_settings | {"columns": 40, "rows": 20, "level": level}
    if limit:
        monkeypatch.setitem(terrain_area.LIMITS, name, terrain_area.FileLimit(1, limit))
    max_gb = 1.0 if limit else 1e-9 * 20_000 * terrain_area.LIMITS[name].bytes
    with pytest.raises(
        InputError, match=rf"export: {name}: 40 x 20 cells have up to \d+ Gaussians, .* 20000; "
    ) as told:
        terrain_area.check_size(cover_terrain, plan(cover_terrain, given), limits(name), max_gb)
    columns, rows = map(int, re.search(r"; (\d+) x (\d+) fit", str(told.value)).groups())
    fits = plan(cover_terrain, given, columns=columns, rows=rows)
    assert 0 < terrain_area.check_size(cover_terrain, fits, limits(name), max_gb)[name] <= 20_000
    wider = plan(cover_terrain, given, columns=columns + 4, rows=rows + 4)
    with pytest.raises(InputError):
        terrain_area.check_size(cover_terrain, wider, limits(name), max_gb)


def test_where_not_one_cell_fits_the_message_says_so(cover_terrain, export_settings):
    with pytest.raises(InputError, match="not one cell fits: set export.level to a coarser one, or raise"):
        terrain_area.check_size(cover_terrain, plan(cover_terrain, export_settings), limits("ply"), 1e-6)


@pytest.mark.parametrize("name", sorted(terrain_area.ALL_LEVELS))
def test_a_set_of_all_levels_is_counted_by_the_finest(cover_terrain, export_settings, name):
    fine, coarse = (plan(cover_terrain, export_settings, level=level) for level in (0, 1))
    most = terrain_area.check_size(cover_terrain, fine, limits(name), 1.0)[name]
    bound = 1e-9 * (most - 1) * terrain_area.LIMITS[name].bytes
    assert terrain_area.check_size(cover_terrain, coarse, limits("ply"), bound)["ply"] < most
    with pytest.raises(InputError, match=rf"export: {name}: 3 x 2 cells have up to {most} Gaussians"):
        terrain_area.check_size(cover_terrain, coarse, limits(name), bound)


@pytest.mark.parametrize("name", sorted(terrain_area.ALL_LEVELS))
def test_the_log_counts_each_format_by_the_levels_that_it_holds(cover_terrain, export_settings, name):
    coarse, both = plan(cover_terrain, export_settings, level=1), limits("ply") | limits(name)
    counts = terrain_area.check_size(cover_terrain, coarse, both, 1.0)
    assert counts["ply"] < counts[name]
    said = terrain_area.describe_size(counts, both)
    assert f"ply {counts['ply']} Gaussians" in said and f"{name} (finest level) {counts[name]} Gaussians" in said


def test_tiles_without_compression_are_larger(export_settings):
    plain, packed = (
        terrain_area.choose_limits(export_settings | {"formats": ["3dtiles", "ply"], "tile_compression": how})
        for how in ("none", "spz")
    )
    assert plain["3dtiles"].bytes > packed["3dtiles"].bytes and plain["ply"] == packed["ply"]


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
    given = export_settings | {"radius": 12.0}
    max_gb = 1e-9 * 20_000 * terrain_area.LIMITS["ply"].bytes
    with pytest.raises(InputError, match=r"ply: a radius of 12 tiles has up to \d+ Gaussians") as told:
        terrain_area.check_size(cover_terrain, plan(cover_terrain, given), limits("ply"), max_gb)
    fits = float(re.search(r"; ([\d.]+) tiles fit: set export\.radius", str(told.value))[1])
    assert (
        terrain_area.check_size(cover_terrain, plan(cover_terrain, given, radius=fits), limits("ply"), max_gb)["ply"]
        <= 20_000
    )
    with pytest.raises(InputError):
        terrain_area.check_size(cover_terrain, plan(cover_terrain, given, radius=fits + 1), limits("ply"), max_gb)


def test_metres_become_tile_sides():
    given = {"centre": ["-3m", 2.0], "radius": "6 m", "level": 0}
    found = terrain_area.resolve_lengths(given, side=4.0, metres=0.5)
    assert found == {"centre": [-1.5, 2.0], "radius": 3.0, "level": 0}


@pytest.mark.parametrize(
    "given, metres, said",
    [
        ({"radius": "6m"}, None, r"export\.radius: 6m: the scale of this terrain is not known"),
        ({"centre": [0.0, "1m"]}, None, r"export\.centre: 1m: the scale of this terrain is not known"),
        ({"radius": "6000m"}, 1.0, r"export\.radius: 1500 tile sides; more than 0 and at most 500"),
        ({"radius": "0m"}, 1.0, r"export\.radius: 0 tile sides"),
        (
            {"radius": 1e-17, "centre": [3.0, 3.0]},
            None,
            r"export\.radius: 1e-17 tile sides touch no cell; make it larger",
        ),
        ({"centre": ["99999999999m", 0.0]}, 1.0, r"export\.centre lies beyond"),
    ],
)
def test_lengths_that_make_no_sense_are_refused(given, metres, said):
    with pytest.raises(InputError, match=said):
        terrain_area.resolve_lengths(given, 4.0, metres)
