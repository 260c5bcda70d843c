"""The cells of a finite terrain, and what is said before work starts."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.export import terrain_files
from dav_gswt.export.formats import EXPORTERS
from dav_gswt.terrain import finite
from dav_gswt.terrain.finite import Area


@pytest.mark.parametrize(
    "centre, columns, expected",
    [
        ([0.0, 0.0], 3, Area(-1, -1, 3, 2)),
        ([10.5, -4.0], 3, Area(9, -5, 3, 2)),
        ([3.9, -0.5], 5, Area(1, -1, 5, 2)),
    ],
)
def test_cells_lie_about_the_centre(centre, columns, expected):
    assert terrain_files.choose_area({"columns": columns, "rows": 2, "centre": centre}) == expected


def plan(terrain, settings, **changes):
    return terrain_files.plan_export(terrain, settings | changes, 0.5)


def test_the_eye_stands_on_the_surface_and_the_origin_is_the_middle(cover_terrain, export_settings):
    wanted = plan(cover_terrain, export_settings, centre=[4.2, 3.0])
    side = cover_terrain.side
    ground = cover_terrain.heights.at(np.array([4.2 * side]), np.array([3.0 * side]))[0][0]
    np.testing.assert_allclose(wanted.eye, [4.2 * side, 3 * side, ground + 0.5])
    np.testing.assert_allclose(wanted.origin, [4.5 * side, 3 * side, 0])


@pytest.mark.parametrize("level, limit", [(0, 20_000), (1, None), ("by_distance", None)])
def test_too_much_is_refused_with_how_much_smaller_it_must_be(
    cover_terrain, export_settings, monkeypatch, level, limit
):
    each = replace(EXPORTERS["glb"], bytes=10, gaussians=limit)

    def check(bound, columns=40):
        wanted = plan(cover_terrain, export_settings, columns=columns, rows=20, level=level)
        monkeypatch.setattr(terrain_files, "MAX_BYTES", 10**9 if limit else 10 * bound)
        terrain_files.check_size(cover_terrain, wanted, {"glb": each})

    with pytest.raises(InputError, match=r"export: glb: 40 x 20 cells have up to \d+ Gaussians, .* 20000; ") as told:
        check(20_000)
    count, share = (int(found) for found in re.search(r"up to (\d+) .* to about (\d+)% of", str(told.value)).groups())
    assert share == round(100 * (20_000 / count) ** 0.5) and "set export.columns and export.rows to" in str(told.value)
    check(20_000, columns=1)
    if not limit:
        check(count)
        with pytest.raises(InputError, match=f"{count} Gaussians, a file holds"):
            check(count - 1)


def test_a_level_that_is_not_there_is_named(cover_terrain, export_settings):
    with pytest.raises(InputError, match=r"export\.level: there is no level 2; the last one is 1"):
        plan(cover_terrain, export_settings, level=2)


@pytest.mark.parametrize("name", [name for name, each in EXPORTERS.items() if each.all_levels])
def test_a_set_of_all_levels_is_counted_by_the_finest(cover_terrain, export_settings, monkeypatch, name):
    coarse, both = plan(cover_terrain, export_settings, level=1), {key: EXPORTERS[key] for key in ("ply", name)}
    count = int(finite.count_cells(finite.keep_level(cover_terrain, 0), coarse.area, coarse.eye).sum())
    monkeypatch.setattr(terrain_files, "MAX_BYTES", count * both[name].bytes)
    terrain_files.check_size(cover_terrain, coarse, both)
    monkeypatch.setattr(terrain_files, "MAX_BYTES", count * both[name].bytes - 1)
    with pytest.raises(InputError, match=rf"export: {name}: 3 x 2 cells have up to {count} Gaussians"):
        terrain_files.check_size(cover_terrain, coarse, both)
