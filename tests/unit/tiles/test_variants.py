"""The ways to cut a tile set, of several materials too, and exemplars that are hardly one."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.bundle import build as bundles
from dav_gswt.bundle.store import read_bundle
from dav_gswt.errors import InputError
from dav_gswt.lod.store import AUTO, Levels
from dav_gswt.materials import build as materials
from dav_gswt.materials import store as material_store
from dav_gswt.terrain import fit_cover
from dav_gswt.terrain.fit_cover import gather_content
from dav_gswt.tiles import build, layout
from dav_gswt.tiles.build import TilingOptions
from dav_gswt.tiles.layout import CENTRE


@pytest.fixture(scope="module")
def every(cut):
    return {kind: cut(kind=kind) for kind in ("none", "semantic")}


def test_without_a_cut_seams_are_straight_and_in_the_middle_of_the_overlap_and_dearer(every):
    straight, cheapest = every["none"].report, every["semantic"].report
    for k in (0, 2):  # the first strips were chosen before anything was cut
        assert straight["strip_energy"][k] > cheapest["strip_energy"][k]
    assert straight["places"]["vertical"] == cheapest["places"]["vertical"]
    plan = layout.plan_layout(96, 3, 0.5, 0.17)
    depth = (plan.block + plan.strip) // 2
    for labels in every["none"].labels:
        inner = np.zeros_like(labels, bool)
        inner[depth:-depth, depth:-depth] = True
        np.testing.assert_array_equal(labels == CENTRE, inner)


def test_uncertain_ground_is_cut_by_semantics_more_than_by_colour(cut):
    report = cut(kind="semantic", slope=8.0, uncertainty=np.full((96, 96), 0.75)).report
    assert report["tile_gamma"] == pytest.approx([1 / (1 + np.exp(2))] * 16)


def test_tiles_go_around_holes_and_unknown_ground_where_they_can(cut, sample_ground, caplog):
    colour, uncertainty = sample_ground.colour.copy(), np.zeros((96, 96))
    colour[30:44, 0:50], uncertainty[:, :20] = np.nan, np.nan
    with caplog.at_level(logging.WARNING):
        found = cut(kind="colour", colour=colour, uncertainty=uncertainty, candidates=400)
    assert "700 of 9216 cells of the exemplar are holes" in caplog.text
    # a patch may be up to UNCERTAINTY_MARGIN more uncertain than the least uncertain one
    assert found.uncertainty.max() < 0.1
    assert all(np.isfinite(field.sh).all() for level in found.fields for field in level)


def test_variants_are_other_centres_in_the_same_frames(cut):
    two = cut(variants=2)
    assert len(two.labels) == 32 and two.variants == 2
    frame = two.labels[:, :4]
    np.testing.assert_array_equal(frame[:16], frame[16:])
    assert (two.shifts[:16, CENTRE] != two.shifts[16:, CENTRE]).any(1).all()


def test_an_exemplar_without_any_known_ground_is_refused(cut):
    holes = np.full((96, 96, 3), np.nan)
    for given in ({"colour": holes}, {"uncertainty": np.ones((96, 96))}, {"uncertainty": holes[..., 0]}):
        with pytest.raises(InputError, match="nothing is known of the exemplar.*masks"):
            cut(**given)


@pytest.mark.parametrize("level", [0, 1])
def test_a_level_from_elsewhere_is_refused(cut, sample_ground, level):
    levels = list(sample_ground.levels)
    levels[level] = replace(levels[level], means=levels[level].means + np.float32(1000))
    with pytest.raises(InputError, match=rf"level {level}.*ground\.json"):
        cut(levels=levels)


OPTIONS = TilingOptions(share=AUTO, strip=AUTO, candidates=24, tries=1, kind="colour")


@pytest.fixture(scope="module")
def found():
    return materials.find_materials(made.field(), made.grid(), 0)


@pytest.fixture(scope="module")
def sets(found):
    return [Levels([each.field], [each.grid], AUTO, "") for each in found.materials]


@pytest.fixture(scope="module")
def tiles(found, sets):
    return build.cut_materials(sets, OPTIONS, found.tile_side, np.random.default_rng)


def test_all_materials_have_tiles_of_one_size_and_mean_height_and_as_many_levels(found, tiles):
    assert len(tiles) == len(found.materials) == 2
    assert len({(own.side, own.spacing, len(own.fields), len(own.labels)) for own in tiles}) == 1
    heights = [np.mean([f.means[:, 2].astype(float).mean() for f in own.fields[0]]) for own in tiles]
    assert heights[0] == pytest.approx(heights[1], abs=1e-5)


def test_tiles_that_a_material_has_no_room_for_are_refused(sets):
    small = replace(sets[1].grids[0], cells=64)
    narrow = [sets[0], replace(sets[1], grids=[small])]
    with pytest.raises(InputError, match=r"smaller `tile` or `materials: one`"):
        build.cut_materials(narrow, replace(OPTIONS, share=0.8), None, np.random.default_rng)


def test_a_bundle_is_made_of_tiles_materials_and_objects(found, tiles, tmp_path, monkeypatch):
    for name, few in (("SAMPLES", 4000), ("LINES", 8), ("PASSES", 1), ("WINDOWS", 1)):
        monkeypatch.setattr(fit_cover, name, few)
    monkeypatch.setattr(fit_cover, "WANTED", 30.0)
    material_store.write_materials(found, tmp_path / "materials", {})
    content = gather_content(tiles, tmp_path / "materials", 7)
    assert [each.name for each in content.materials] == ["material0", "material1"]
    assert len(content.objects) == len(found.objects)
    assert content.classes is not None and content.scatter is not None
    bundles.write_bundle(content, tmp_path / "bundle", bundles.BundleOptions(tau=0.5), {})
    bundle, each = read_bundle(tmp_path / "bundle"), len(tiles[0].labels)
    assert bundle.manifest.composition.exemplars == [own.recipe.levels[0].exemplar.cells for own in tiles]
    for number in (0, each + 3):  # of either material
        cut, composed = tiles[number // each].fields[0][number % each], bundle.chunk(number, 0)
        assert len(composed) == len(cut)
        step = max(bundle.manifest.encoding.step)  # ground, underlay and things are stored apart
        np.testing.assert_allclose(composed.means.mean(0), cut.means.mean(0), atol=step)
    with pytest.raises(InputError, match="of the first one alone"):
        gather_content(tiles[:1], tmp_path / "materials", 7)
    alone = gather_content(tiles[:1], None, 7)
    assert (len(alone.materials), alone.objects) == (1, [])
