from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import cover_content
from fixtures.splats import rough_ground
from fixtures.terrains import MAGENTA, manifest_of, stony_terrain
from fixtures.tile_sets import report_of

from dav_gswt.bundle import build, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.study.terrain import flicker, presort
from dav_gswt.terrain import draw_order
from dav_gswt.tiles.build import TileSet

SIDE = 4.0


def content_of(levels) -> BundleContent:
    fields = [[rough_ground(tile, 32 >> level, SIDE) for tile in range(16)] for level in range(levels)]
    labels, shifts = np.zeros((16, 32, 32), np.uint8), np.zeros((16, 9, 2), int)
    return BundleContent.of_one_material(TileSet(SIDE, SIDE / 32, fields, labels, shifts, np.zeros(16), report_of()))


@pytest.fixture
def bundled(monkeypatch, tmp_path, root):
    """Write content as a bundle; pictures are small."""
    monkeypatch.setattr(presort, "WIDTH", 64)
    monkeypatch.setattr(presort, "HEIGHT", 36)
    monkeypatch.setattr(presort, "REACH", 11)
    monkeypatch.setattr(presort, "VIEWS", presort.VIEWS[:2])
    schema = root / "workflow/schemas/davgswt.schema.json"

    def write(content, **more):
        build.write_bundle(content, tmp_path / "bundle", build.BundleOptions(tau=1.0, **more), schema, {})
        return store.read_bundle(tmp_path / "bundle", schema)

    return write


def of(rows, shortcut):
    return {row["view"]: row["psnr"] for row in rows if row["shortcut"] == shortcut}


def test_every_shortcut_has_a_price_of_its_own(bundled):
    content = content_of(2)
    # coarse discs begin where one is twelve pixels wide: within what is placed
    rows = presort.measure_approximations(content, bundled(content, level_pixels=12.0))
    assert all(20 < r["psnr"] < 100 for r in rows if r["psnr"] is not None)
    assert min(of(rows, "rounding").values()) > 45
    assert of(rows, "levels")["walker"] < of(rows, "rounding")["walker"], "coarse discs are seen, rounding is not"
    for view, found in of(rows, "all").items():
        assert found < 3 + min(v for s in presort.APPROXIMATIONS[:-1] if (v := of(rows, s).get(view)) is not None)


def test_objects_and_all_materials_are_in_both_pictures(bundled):
    content = cover_content()
    rows = presort.measure_approximations(content, bundled(content))
    assert min(v for v in of(rows, "rounding").values() if v is not None) > 40, "one lacks what the other has"
    assert of(rows, "objects") != of(rows, "presorting"), "the ground alone"


def test_orders_of_another_direction_cost_more_and_one_level_costs_nothing(bundled, monkeypatch):
    monkeypatch.setattr(presort, "VIEWS", presort.VIEWS[1:])
    content = content_of(1)
    good = bundled(content)
    away = [[0.0, 0.0, -1.0]] * len(good.manifest.directions)  # from above only
    bad = replace(good, manifest=replace(good.manifest, directions=away))
    rows = [presort.measure_approximations(content, bundle) for bundle in (good, bad)]
    found = [of(each, "presorting")["walker"] for each in rows]
    assert found[0] is None or found[0] > found[1]
    assert set(of(rows[0], "levels").values()) == {None}


MANIFEST = manifest_of(eye_floor=1.0, ground_colour=MAGENTA)


def test_every_second_pair_of_frames_lies_across_a_border():
    found = flicker.make_frame_pairs(8, 3.0, 0.01)
    for k, (before, after) in enumerate(found):
        np.testing.assert_allclose(np.hypot(*np.subtract(after.at, before.at)), 0.01)
        assert (np.floor(before.at) != np.floor(after.at)).any() == bool(k % 2)


def test_a_slow_walk_in_pre_sorted_orders_jumps_no_more_than_twice_as_far_and_a_jump_is_found(monkeypatch):
    """The jump: orders that turn about from one frame to the next."""
    stony = stony_terrain()
    found = flicker.measure_flicker(stony, MANIFEST, 2, 2.0, 96, 54, 10**6)
    assert (found[0]["east"], found[0]["north"]) == (0.5, 0.5)  # the way is counted in tiles
    assert all(row["exact_largest"] > 0 for row in found)
    assert flicker.compare_largest_changes(found) < flicker.MAX_RATIO
    turns = iter(range(10**6))
    monkeypatch.setattr(draw_order, "nearest_order", lambda directions, kept, *_: next(turns) * 5 % len(kept))
    found = flicker.measure_flicker(stony, MANIFEST, 2, 1.0, 48, 27, 10**6)
    assert flicker.compare_largest_changes(found) > flicker.MAX_RATIO
