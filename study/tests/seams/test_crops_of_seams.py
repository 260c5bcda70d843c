from dataclasses import replace

import numpy as np
import pytest
from fixtures import seams

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt.terrain import heights, stills
from dav_gswt_study.seams import crops, measure, places, rendering
from dav_gswt_study.seams.rendering import SpatialIndex

HILLS = {"kind": "hills", "height": 1.0, "wavelength": 8.0}
_, WALKER, TOP = crops.VIEWS


@pytest.mark.parametrize("view, surface", [(WALKER, HILLS), (TOP, {"kind": "flat"})])
def test_a_crop_is_the_terrain_s_own_picture(placed, view, surface, rng):
    terrain = replace(placed.terrain, heights=heights.surface_from_config(surface, placed.terrain.side, 1.0))
    some = (crops.find_cut(placed, terrain, view, place.at) for place in places.sample_cuts(placed, rng))
    crop, met = next(filter(None, some))
    expected = stills.render_view(terrain, crop.camera, rendering.SKY, placed.colour)
    np.testing.assert_array_equal(crops.render_patches(placed, terrain, crop, met).picture, expected)


def test_across_every_border_the_patch_is_the_same(placed):
    """But where a strip's cut against its corner happens to run along the border for some cells."""
    n, a = placed.plan.side, placed.plan.corner
    edges, along = np.arange(n, len(placed.patch), n), np.arange(len(placed.patch)) % n
    strip = (along >= a) & (along < n - a)
    for patch in (placed.patch, placed.patch.T):
        before, after = patch[edges - 1], patch[edges]
        np.testing.assert_array_equal(before[:, strip], after[:, strip])
        assert (before == after)[:, ~strip].mean() > 0.9


def brighter(field, which):
    sh = field.sh.copy()
    sh[which, 0] += 0.5
    return replace(field, sh=sh)


@pytest.mark.parametrize("change", [brighter, lambda field, which: field[~which]], ids=["step", "gap"])
def test_a_border_broken_on_purpose_is_found(placed, change, rng):
    """Every tile is changed in the cells within 3 cells of its western border."""
    tiles = {
        key: SpatialIndex.from_field(change(field, field.means[:, 0] < 3 * placed.spacing))
        for key, field in placed.terrain.tiles.items()
    }
    upright = [p for p in places.sample_borders(placed, rng) if p.cluster.startswith("v")][:6]
    seen = [crops.make_crop(placed, placed.terrain, TOP, place.at) for place in upright]
    crop, met = next((crop, met) for crop in seen if (met := crops.find_patches(placed, crop)))
    whole, bad = (
        crops.render_patches(each, each.terrain, crop, met, border=True)
        for each in (placed, replace(placed, tiles=tiles))
    )
    weight = np.ones(whole.picture.shape[:2])
    psnr = [metrics.psnr(each.picture, whole.own[0], weight) for each in (whole, bad)]
    assert psnr[0] > 33 and psnr[1] < psnr[0] - 2  # tiles and exemplar hold the same Gaussians, but for corrections
    jumps = [measure.measure_jump(each.picture, each.tile, each.patch >= 0) for each in (whole, bad)]
    assert change is not brighter or jumps[1] > 1.1 * jumps[0]  # a texture has jumps of its own


def test_the_middle_of_a_crop_is_its_place_on_the_ground(placed, rng):
    terrain = replace(placed.terrain, heights=heights.surface_from_config(HILLS, placed.terrain.side, 1.0))
    some = places.sample_borders(placed, rng)
    for view in crops.VIEWS:
        crop = next(filter(None, (crops.make_crop(placed, terrain, view, place.at) for place in some)))
        spot = np.array(crop.at) * placed.spacing
        (height,), _ = terrain.heights.at(spot[:1], spot[1:])
        pixel, _ = crop.camera.project(np.array([[*spot, height + placed.mean_height(crop.at)]]))
        np.testing.assert_allclose(pixel, crops.SIDE / 2, atol=1e-6)
        assert np.abs(crop.cells[crops.SIDE // 2, crops.SIDE // 2] - crop.at).max() <= 3
    # the ground's height is that of the tile's own cells
    n, x, y = placed.plan.side, 3 - placed.first, 5 - placed.first
    column, row = [3, 5] - placed.origins[placed.patch[y, x]]
    expected = placed.source.ground[row, column, 3] + placed.correction[placed.tile[y, x], y % n, x % n, 3]
    assert placed.relief[y, x] == pytest.approx(expected, nan_ok=True)
    bare = replace(placed, source=replace(placed.source, ground=np.full_like(placed.source.ground, np.nan)))
    assert bare.mean_height((3, 5)) == 0


def test_a_jump_is_1_without_a_seam_and_as_high_as_the_step_makes_it():
    """Texture noise of deviation s in 3 channels: neighbours differ by RMS sqrt(6) s; a step d adds 3 d^2 across."""
    known = np.ones((48, 48), bool)
    for step in (0.0, 0.1, 0.2):
        texture, picture, patch = seams.halves(step)
        found = measure.measure_jump(picture, patch, known)
        expected = np.sqrt((6 * 0.1**2 + 3 * step**2) / (6 * 0.1**2))
        assert found == pytest.approx(expected, rel=0.15)  # 48 pairs across: their variance has 10 %, and values clip
        assert found == measure.measure_jump(picture[:, ::-1], patch[:, ::-1], known)
    assert measure.measure_jump(picture, np.zeros_like(patch), known) is None
    assert measure.measure_jump(np.zeros_like(picture), patch, known) is None


def test_ceilings_lie_in_the_tile_of_their_cuts(placed, straight, rng):
    n = placed.plan.side
    for place in places.sample_cuts(placed, rng)[:20]:
        twin = places.find_nearest_cut(straight, place)
        assert [v // n for v in twin.at] == [v // n for v in place.at] and twin.cluster == place.cluster
    bare = replace(placed, patch=np.zeros_like(placed.patch), origins=placed.origins[:1])
    with pytest.raises(InputError, match="only 0 of .* cuts could be rendered"):
        measure._sample_cuts(bare, placed.terrain, (straight, straight.terrain), TOP, rng)


def test_crops_have_numbers_of_their_own_and_without_weights_no_seam_lpips(placed, straight, monkeypatch):
    monkeypatch.setattr(measure, "BORDERS", 2)
    monkeypatch.setattr(measure, "CUTS", 2)
    monkeypatch.setattr(crops, "VIEWS", [TOP])
    found = measure.measure_crops(placed, straight, None, 0)
    assert [row["seam_lpips"] for row in found] == [None] * len(found)  # absent, never made up
    numbers = {name: {r["crop"] for r in found if r["place"] == name} for name in ("border", "cut", "ceiling", "floor")}
    assert numbers == {"border": {0, 1}, "cut": {2, 3}, "ceiling": {4, 5}, "floor": set(range(6))}
