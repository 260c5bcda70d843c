"""What orders, levels and rounding do to a picture, each by itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.land_covers import cover_content
from fixtures.splats import rough_ground
from fixtures.tile_sets import report_of

from dav_gswt.bundle import build, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.study.terrain import presort
from dav_gswt.tiles.build import TileSet

SCHEMA = Path(__file__).parents[4] / "workflow/schemas/davgswt.schema.json"
SIDE = 4.0


def content_of(levels) -> BundleContent:
    fields = [[rough_ground(tile, 32 >> level, SIDE) for tile in range(16)] for level in range(levels)]
    tiles = TileSet(
        SIDE, SIDE / 32, fields, np.zeros((16, 32, 32), np.uint8), np.zeros((16, 9, 2), int), np.zeros(16), report_of()
    )
    return BundleContent.of_one_material(tiles)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(presort, "WIDTH", 64)
    monkeypatch.setattr(presort, "HEIGHT", 36)


def bundled(content, folder, **more):
    build.write_bundle(content, folder, build.BundleOptions(tau=1.0, **more), SCHEMA, {})
    return store.read_bundle(folder, SCHEMA)


def of(rows, shortcut):
    return {row["view"]: row["psnr"] for row in rows if row["shortcut"] == shortcut}


def test_every_shortcut_has_a_price_of_its_own(tmp_path):
    content = content_of(2)
    # coarse discs begin where one is twelve pixels wide: within what is placed
    rows = presort.measure_approximations(content, bundled(content, tmp_path / "bundle", level_pixels=12.0))
    assert [(r["view"], r["shortcut"]) for r in rows] == [
        (v.name, s) for v in presort.VIEWS for s in presort.APPROXIMATIONS if s != "objects"
    ]
    assert all(20 < r["psnr"] < 100 for r in rows if r["psnr"] is not None)
    assert min(of(rows, "rounding").values()) > 45
    assert of(rows, "levels")["walker"] < of(rows, "rounding")["walker"], "coarse discs are seen, rounding is not"
    for view, found in of(rows, "all").items():
        assert found < 3 + min(v for s in presort.APPROXIMATIONS[:-1] if (v := of(rows, s).get(view)) is not None)


def test_one_level_costs_nothing(tmp_path):
    content = content_of(1)
    rows = presort.measure_approximations(content, bundled(content, tmp_path / "bundle"))
    assert set(of(rows, "levels").values()) == {None}


def test_objects_and_all_materials_are_in_both_pictures(tmp_path):
    content = cover_content()
    rows = presort.measure_approximations(content, bundled(content, tmp_path / "bundle"))
    assert min(v for v in of(rows, "rounding").values() if v is not None) > 40, "one lacks what the other has"
    assert of(rows, "objects") != of(rows, "presorting"), "the ground alone"


def test_orders_of_another_direction_cost_more(tmp_path):
    content = content_of(1)
    good = bundled(content, tmp_path / "bundle")
    away = [[0.0, 0.0, -1.0]] * len(good.manifest.directions)
    bad = replace(good, manifest=replace(good.manifest, directions=away))  # from above only
    found = [of(presort.measure_approximations(content, bundle), "presorting")["walker"] for bundle in (good, bad)]
    assert found[0] is None or found[0] > found[1]


def test_the_figure_takes_what_the_table_has(tmp_path):
    row = {"scene": "desert", "view": "near", "shortcut": "levels", "psnr": "41.5"}
    presort.write_presort_plot(tmp_path / "a.png", [row, row | {"shortcut": "rounding", "psnr": ""}])
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
