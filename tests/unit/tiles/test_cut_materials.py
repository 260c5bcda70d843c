"""Tiles of several materials, and what a bundle makes of them."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.bundle import build as bundles
from dav_gswt.bundle.store import read_bundle
from dav_gswt.errors import InputError
from dav_gswt.lod import store as levels
from dav_gswt.lod.store import AUTO, Levels
from dav_gswt.materials import build as materials
from dav_gswt.materials import store as material_store
from dav_gswt.terrain import fit_cover
from dav_gswt.terrain.fit_cover import gather_content
from dav_gswt.tiles import build, store
from dav_gswt.tiles.build import TilingOptions

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


def test_tiles_of_several_materials_are_written_and_read(tiles, sets, tmp_path):
    levels.write_levels(sets, tmp_path / "levels", {})
    store.write_tiles(tiles, tmp_path / "tiles", tmp_path / "seams.json", {})
    read = store.read_material_tiles(tmp_path / "tiles", tmp_path / "seams.json", tmp_path / "levels")
    assert len(read) == 2
    for one, two in zip(read, tiles, strict=True):
        np.testing.assert_array_equal(one.fields[-1][3].means, two.fields[-1][3].means)
        np.testing.assert_array_equal(one.labels, two.labels)


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
