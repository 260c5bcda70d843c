"""Crops: drawn as the terrain is, patches that continue across borders, what a broken border does to psnr and jump."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import seams

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt.raster.interface import RIM
from dav_gswt.study.seams import crops, measure, places, rendering
from dav_gswt.study.seams.spatial_index import MAX_SLOPE, Footprint, SpatialIndex
from dav_gswt.terrain import heights, stills

HILLS = {"kind": "hills", "height": 1.0, "wavelength": 8.0}


def first_of(placed, terrain, view, kind, rng, border=False):
    for place in kind(placed, rng):
        crop = crops.make_crop(placed, terrain, view, place.at)
        if crop and (met := crops.find_patches(placed, crop)) and (border or len(met) > 1):
            return crops.render_patches(placed, terrain, crop, met, border)
    raise AssertionError("no crop")


@pytest.mark.parametrize("view", crops.VIEWS, ids=lambda view: view.name)
@pytest.mark.parametrize("surface", [{"kind": "flat"}, HILLS], ids=lambda entry: entry["kind"])
def test_a_crop_is_the_terrain_s_own_picture(placed, view, surface, rng):
    terrain = replace(placed.terrain, heights=heights.surface_from_config(surface, placed.terrain.side))
    shown = first_of(placed, terrain, view, places.sample_cuts, rng)
    np.testing.assert_array_equal(
        shown.picture, stills.render_view(terrain, shown.crop.camera, rendering.SKY, placed.colour)
    )


def test_across_every_border_the_patch_is_the_same(placed):
    """But where a strip's cut against its corner happens to run along the border for some cells."""
    n, a = placed.plan.side, placed.plan.corner
    edges, along = np.arange(n, len(placed.patch), n), np.arange(len(placed.patch)) % n
    strip = (along >= a) & (along < n - a)
    for patch in (placed.patch, placed.patch.T):
        before, after = patch[edges - 1], patch[edges]
        np.testing.assert_array_equal(before[:, strip], after[:, strip])
        assert (before == after)[:, ~strip].mean() > 0.9


def test_the_exemplar_placed_whole_shows_what_a_tile_of_one_patch_shows(placed, rng):
    """A crop on a border far from any cut: tiles and exemplar hold the same Gaussians, but for the corrections."""
    shown = first_of(placed, placed.terrain, crops.VIEWS[2], places.sample_borders, rng, border=True)
    assert len(shown.patches) == 1 and set(np.unique(shown.tile)) > {int(shown.tile[0, 0])}
    weight = np.ones(shown.picture.shape[:2])
    assert metrics.psnr(shown.picture, shown.own[0], weight) > 33  # what of a correction varies within the crop


def broken(placed, change):
    """The same with every tile changed in the cells within 3 cells of its western border."""
    out = {}
    for key, field in placed.terrain.tiles.items():
        out[key] = change(field, field.means[:, 0] < 3 * placed.spacing)
    return replace(placed, tiles={key: SpatialIndex.from_field(field) for key, field in out.items()})


def brighter(field, which):
    sh = field.sh.copy()
    sh[which, 0] += 0.5
    return replace(field, sh=sh)


def moved(field, which):
    means = field.means.copy()
    means[which, 1] += np.float32(0.25)  # two cells
    return replace(field, means=means)


@pytest.mark.parametrize("change", [brighter, moved, lambda field, which: field[~which]], ids=["step", "shift", "gap"])
def test_a_border_broken_on_purpose_is_found(placed, change, rng):
    view = crops.VIEWS[2]
    upright = [p for p in places.sample_borders(placed, rng) if p.cluster.startswith("v")][:6]
    for place in upright:
        crop = crops.make_crop(placed, placed.terrain, view, place.at)
        met = crops.find_patches(placed, crop)
        if not met:
            continue
        whole, bad = (
            crops.render_patches(each, each.terrain, crop, met, border=True)
            for each in (placed, broken(placed, change))
        )
        weight = np.ones(whole.picture.shape[:2])
        psnr = [metrics.psnr(each.picture, whole.own[0], weight) for each in (whole, bad)]
        assert psnr[1] < psnr[0] - 2
        jumps = [measure.measure_jump(each.picture, each.tile, each.patch >= 0) for each in (whole, bad)]
        assert change is not brighter or jumps[1] > 1.1 * jumps[0]  # a texture has jumps of its own
        return
    raise AssertionError("no border could be looked at")


def raised(placed, height):
    """The same with all ground and what stands on it higher."""
    out = {}
    for key, field in placed.terrain.tiles.items():
        out[key] = SpatialIndex.from_field(replace(field, means=field.means + np.float32([0, 0, height])))
    ground = placed.source.ground + [0, 0, 0, height]
    return replace(placed, tiles=out, source=replace(placed.source, ground=ground))


@pytest.mark.parametrize("view", crops.VIEWS, ids=lambda view: view.name)
def test_a_crop_shows_what_it_is_of_however_high_the_ground_lies(placed, view, rng):
    """Aimed at a plane below it, a walker's crop would show ground 2.7 times that height before the place."""
    place = next(
        p
        for p in places.sample_borders(placed, rng)
        if crops.find_patches(placed, crops.make_crop(placed, placed.terrain, view, p.at))
    )
    tiles = []
    for each in (placed, raised(placed, 12 * placed.spacing)):
        crop = crops.make_crop(each, each.terrain, view, place.at)
        tiles.append(crops.render_patches(each, each.terrain, crop, crops.find_patches(each, crop), border=True).tile)
    assert len(np.unique(tiles[0])) > 1
    assert (tiles[0] == tiles[1]).mean() > 0.95


def test_the_ground_s_height_is_that_of_the_tile_s_own_cells(placed):
    assert raised(placed, 2.0).mean_height((3, 5)) == pytest.approx(2.0 + placed.mean_height((3, 5)))
    n, height = placed.plan.side, placed.source.ground[..., 3]
    x, y = 3 - placed.first, 5 - placed.first
    column, row = [3, 5] - placed.origins[placed.patch[y, x]]
    expected = height[row, column] + placed.correction[placed.tile[y, x], y % n, x % n, 3]
    assert placed.relief[y, x] == pytest.approx(expected, nan_ok=True)
    bare = replace(placed, source=replace(placed.source, ground=np.full_like(placed.source.ground, np.nan)))
    assert bare.mean_height((3, 5)) == 0


def test_borders_are_shown_without_cuts_where_that_is_possible(placed, rng):
    places_looked_at = places.sample_borders(placed, np.random.default_rng(2))[: measure.MAX_BORDER_PLACES]
    view = crops.VIEWS[2]
    met = [
        crops.find_patches(placed, crops.make_crop(placed, placed.terrain, view, place.at))
        for place in places_looked_at
    ]
    alone = sum(bool(each) and len(each) == 1 for each in met)
    taken = measure._sample_borders(placed, placed.terrain, view, np.random.default_rng(2))
    shown = [len(each.shown.patches) for each in taken]
    assert 0 < shown.count(1) == min(alone, measure.BORDERS) and shown == sorted(shown, key=lambda n: n > 1)


def test_a_jump_is_1_without_a_seam_and_as_high_as_the_step_makes_it():
    """Texture noise of deviation s in 3 channels: neighbours differ by RMS sqrt(6) s; a step d adds 3 d^2 across."""
    known = np.ones((48, 48), bool)
    for step in (0.0, 0.1, 0.2):
        texture, picture, patch = seams.halves(step)
        found = measure.measure_jump(picture, patch, known)
        expected = np.sqrt((6 * 0.1**2 + 3 * step**2) / (6 * 0.1**2))
        assert found == pytest.approx(expected, rel=0.15)  # 48 pairs across: their variance has 10 %, and values clip
        assert found == measure.measure_jump(picture[:, ::-1], patch[:, ::-1], known)


def test_a_jump_needs_two_sides():
    texture, picture, patch = seams.halves()
    assert measure.measure_jump(picture, np.zeros_like(patch), np.ones(patch.shape, bool)) is None
    assert measure.measure_jump(np.zeros_like(picture), patch, np.ones(patch.shape, bool)) is None


def test_a_hill_before_a_point_hides_it(placed):
    steep = replace(placed.terrain, heights=heights.Hills(40 * placed.terrain.side, 8 * placed.terrain.side, 1, 0))
    found = [
        crops.make_crop(placed, steep, crops.VIEWS[1], place.at)
        for place in places.sample_borders(placed, np.random.default_rng(1))[:40]
    ]
    assert None in found


def test_ceilings_lie_in_the_tile_of_their_cuts(placed, straight, rng):
    n = placed.plan.side
    for place in places.sample_cuts(placed, rng)[:20]:
        twin = places.find_nearest_cut(straight, place)
        assert [v // n for v in twin.at] == [v // n for v in place.at] and twin.cluster == place.cluster


def test_tiles_without_cuts_are_named(placed, straight, rng):
    bare = replace(placed, patch=np.zeros_like(placed.patch), origins=placed.origins[:1])
    with pytest.raises(InputError, match="only 0 of .* cuts could be rendered"):
        measure._sample_cuts(bare, placed.terrain, (straight, straight.terrain), crops.VIEWS[2], rng)


def test_the_same_crops_are_drawn_by_any_number_of_threads(placed, straight, monkeypatch):
    monkeypatch.setattr(measure, "BORDERS", 2)
    monkeypatch.setattr(measure, "CUTS", 2)
    monkeypatch.setattr(crops, "VIEWS", crops.VIEWS[2:])
    found = []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(measure.measure_crops(placed, straight, None, 0))
    assert found[0] == found[1]
    assert [row["seam_lpips"] for row in found[0]] == [None] * len(found[0])  # no weights: absent, never made up
    assert {row["place"] for row in found[0]} == {"border", "cut", "floor", "ceiling"}


def test_crops_that_are_hidden_altogether_are_passed_over(placed, straight, monkeypatch, rng):
    shown, seen = crops.render_patches, []

    def every_other(*args, **kwargs):
        found = shown(*args, **kwargs)
        seen.append(found)
        return replace(found, patch=np.full_like(found.patch, -1)) if len(seen) % 3 == 0 else found

    monkeypatch.setattr(crops, "render_patches", every_other)
    monkeypatch.setattr(measure, "BORDERS", 4)
    monkeypatch.setattr(measure, "CUTS", 4)
    view = crops.VIEWS[2]
    borders = measure._sample_borders(placed, placed.terrain, view, rng)
    cuts = measure._sample_cuts(placed, placed.terrain, (straight, straight.terrain), view, rng)
    assert len(seen) > 12 and all(each.shown.shows_patch for each in (*borders, *cuts))
    assert [each.number for each in borders] == [0, 1, 2, 3]
    assert [each.number for each in cuts] == [4, 8, 5, 9, 6, 10, 7, 11]


def test_the_few_gaussians_of_the_exemplar_that_may_show_are_found_among_all(source, rng):
    for index in source.levels:
        size = np.ptp(index.field.means[:, :2], axis=0).min()
        for _ in range(20):
            west, south = rng.uniform(-0.2, 1.0, 2) * size
            box = np.array([[west, south], [west + 0.2 * size, south + 0.1 * size]])
            seen = Footprint(box, rng.normal(0, 2, 2))
            corner = np.array([*rng.uniform(-size, size, 2) * 0.1, 0.0])
            found, wanted = index.query(seen, corner), index.field[_shows(seen, index.field, corner)]
            np.testing.assert_array_equal(found.means, wanted.means)
            np.testing.assert_array_equal(found.sh, wanted.sh)
    assert len(wanted) < len(index.field)


def _shows(seen, field, corner):
    """Each Gaussian asked for itself, as docs of `Footprint.occlusion_range` say it."""
    shown = []
    reaches = RIM * np.exp(field.log_scales.astype(float).max(1))
    for place, reach in zip(field.means.astype(float), reaches, strict=True):
        behind = [MAX_SLOPE * (place[2] + up) * seen.per_height for up in (-reach, reach)] + [np.zeros(2)]
        low = place[:2] + corner[:2] - reach + np.min(behind, 0)
        high = place[:2] + corner[:2] + reach + np.max(behind, 0)
        shown.append(bool((high > seen.box[0]).all() and (low < seen.box[1]).all()))
    return np.array(shown)


def test_an_empty_shelf_shows_nothing(source):
    empty = SpatialIndex.from_field(source.levels[0].field[:0])
    assert len(empty.query(Footprint(np.array([[0.0, 0], [1, 1]]), np.ones(2)), np.zeros(3))) == 0
