"""The cells of a finite terrain, and what is said before work starts."""

import re
from dataclasses import replace

import pytest

from dav_gswt.errors import InputError
from dav_gswt.export import terrain_files
from dav_gswt.export.formats import FORMATS
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


@pytest.mark.parametrize("level, limit", [(0, 20_000), (1, None)])
def test_too_much_is_refused_with_how_much_smaller_it_must_be(cover_terrain, monkeypatch, level, limit):
    each = replace(FORMATS["glb"], bytes=10, gaussians=limit)

    def check(bound, columns=40):
        monkeypatch.setattr(terrain_files, "MAX_BYTES", 10**9 if limit else 10 * bound)
        terrain_files.check_size(cover_terrain, Area(-columns // 2, -10, columns, 20), level, {"glb": each})

    with pytest.raises(InputError, match=r"export: glb: 40 x 20 cells have up to \d+ Gaussians, .* 20000; ") as told:
        check(20_000)
    count, share = (int(found) for found in re.search(r"up to (\d+) .* to about (\d+)% of", str(told.value)).groups())
    assert share == round(100 * (20_000 / count) ** 0.5) and "set export.columns and export.rows to" in str(told.value)
    check(20_000, columns=1)
    if not limit:
        check(count)
        with pytest.raises(InputError, match=f"{count} Gaussians, a file holds"):
            check(count - 1)
