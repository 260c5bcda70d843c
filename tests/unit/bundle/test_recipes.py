"""Bundles of tile sets with recipes: composed tiles are those that were cut, with the same bytes each time."""

from types import SimpleNamespace

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt.bundle import build, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.field import concatenate_fields
from dav_gswt.reconstruction import discs
from dav_gswt.tiles.compose import find_underlay

LEVELS, COMPOSED = 4, 3  # of the tiles; the last level is merged from their cells


@pytest.fixture(scope="module")
def tiles():
    """A set whose exemplar has an underlay among its discs and things."""
    made = tile_sets.exemplar()
    layers = zip(made.levels, tile_sets.levels_of(made).grids, strict=True)
    under = [concatenate_fields([field, discs.make_underlay(grid, field)]) for field, grid in layers]
    return tile_sets.tiles_of(SimpleNamespace(**vars(made) | {"levels": under}), levels=LEVELS)


@pytest.fixture(scope="module")
def bundle(tiles, tmp_path_factory):
    return write(tiles, tmp_path_factory.mktemp("bundle") / "b")


def write(tiles, folder):
    options = build.BundleOptions(tau=0.5, salt=7)
    build.write_bundle(BundleContent.of_one_material(tiles), folder, options, {"from": "a test"})
    return store.read_bundle(folder)


def order_by_layers(field, spacing):
    """The Gaussians of a tile that was cut, in the order of a composed one: ground, underlay, what else."""
    under = find_underlay(field, spacing)
    layers = np.where(field.ground, 0, np.where(under, 1, 2))
    assert set(layers) == {0, 1, 2}
    return field[np.argsort(layers, kind="stable")]


def test_composed_tiles_are_those_that_were_cut_within_steps(bundle, tiles):
    code = bundle.manifest.encoding
    for tile in range(16):
        for level in range(COMPOSED):
            cut = order_by_layers(tiles.fields[level][tile], tiles.spacing * 2**level)
            found = bundle.chunk(tile, level)
            assert len(found) == len(cut) == bundle.manifest.tiles[tile].chunks[level].count
            np.testing.assert_array_equal(found.ground, cut.ground)
            away = np.abs(found.means.astype(float) - cut.means)
            # half a step, and float32's last digit; of heights and colours as much again for the correction, which is
            # rounded by itself, and on coarser cells half a step more, as the mean of rounded ones
            rounded = 1.0 if level == 0 else 1.5
            assert (away.max(0) <= np.multiply(code.step, [0.5, 0.5, rounded]) + 2e-6).all()
            shown = np.clip(cut.base_colours, 0, 1)
            assert np.abs(found.base_colours - shown).max() <= rounded / 255 + 1e-6
            assert np.abs(found.log_scales.max(1) - cut.log_scales.max(1)).max() <= 0.5 * code.log_scale[1] + 1e-5
        stored, cut = bundle.chunk(tile, COMPOSED), tiles.fields[COMPOSED][tile]
        assert len(stored) == len(cut)
        assert (np.abs(stored.means - cut.means).max(0) <= np.multiply(code.step, 0.5) + 2e-6).all()


def test_the_same_tiles_give_the_same_bytes(bundle, tiles, tmp_path):
    again = write(tiles, tmp_path / "b")
    for file in ["davgswt.json", *(part.file for part in bundle.manifest.parts)]:
        assert (again.folder / file).read_bytes() == (bundle.folder / file).read_bytes(), file
