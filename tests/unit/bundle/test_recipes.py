"""Bundles of tile sets with recipes: composed tiles are those that were cut, fit together, and take little room."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt.bundle import build, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.parts import LEVEL, RECIPES, Block, read_part
from dav_gswt.bundle.recipes import GROUND, UNDERLAY, Layer, TileRecipe, compose_records, unpack_level, unpack_recipes
from dav_gswt.field import concatenate_fields
from dav_gswt.reconstruction import discs
from dav_gswt.tiles.compose import find_underlay

LEVELS, COMPOSED, CELLS = 4, 3, 48  # of the tiles; the last level is merged from their cells
EAST, WEST, NORTH, SOUTH = 2, 8, 4, 1  # bits of a tile's number


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


def read(bundle, kind, level=None):
    """The content of a part."""
    entry = next(part for part in bundle.manifest.parts if part.kind == kind and part.level == level)
    data, composition = read_part(bundle.folder, entry), bundle.manifest.composition
    if kind == RECIPES:
        return unpack_recipes(data, composition, 16, entry.file)
    return unpack_level(data, composition, level, entry.file)[0]


def test_levels_of_the_exemplar_are_composed_and_what_is_coarser_is_stored(bundle):
    parts, composition = bundle.manifest.parts, bundle.manifest.composition
    assert [(part.kind, part.level) for part in parts] == [
        ("records", None),
        ("recipes", None),
        *(("level", level) for level in (2, 1, 0)),
    ]
    assert (composition.side, composition.levels, composition.exemplars) == (CELLS, COMPOSED, [tile_sets.CELLS])
    for tile in bundle.manifest.tiles:
        assert [chunk.part for chunk in tile.chunks] == [None] * COMPOSED + [0]


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


ALONG = {EAST: (..., -1), WEST: (..., 0), NORTH: (..., -1, slice(None)), SOUTH: (..., 0, slice(None))}


@pytest.mark.parametrize("level", range(COMPOSED))
def test_sides_of_one_colour_show_the_same_cells_at_the_same_height(bundle, level):
    recipes = [tile[level] for tile in read(bundle, RECIPES)]
    for side, along in ALONG.items():
        for colour in (0, side):
            first, *others = [recipe for tile, recipe in enumerate(recipes) if tile & side == colour]
            for other in others:
                np.testing.assert_array_equal(other.cells[along], first.cells[along])
                change = np.abs(other.correction[along].astype(int) - first.correction[along])
                assert change[0].max() <= 1 and change[1:].max() == 0, "z may be rounded elsewhere"


@pytest.mark.parametrize("level", range(COMPOSED))
def test_the_exemplar_goes_on_over_a_border(bundle, level):
    """But where a cut between two patches runs over it, in a cell or two."""
    recipes, cells = [tile[level].cells for tile in read(bundle, RECIPES)], tile_sets.CELLS >> level
    for here, there, step in ((EAST, WEST, 1), (NORTH, SOUTH, cells)):
        for one in range(16):
            for other in (tile for tile in range(16) if bool(tile & there) == bool(one & here)):
                follows = recipes[one][ALONG[here]] + step == recipes[other][ALONG[there]]
                assert (~follows).sum() <= 2


def test_only_cells_that_a_tile_shows_are_stored(bundle, tiles):
    for level in range(COMPOSED):
        shown = np.unique([tile[level].cells for tile in read(bundle, RECIPES)])
        layers, held = read(bundle, LEVEL, level), np.diff(tiles.recipe.levels[level].start)
        count = np.sum([np.diff(layer.start) for layer in layers], 0)
        assert len(shown) < len(held)
        np.testing.assert_array_equal(count[shown], held[shown])
        assert count.sum() == held[shown].sum()
        assert (np.diff(layers[GROUND].start)[shown] == 1).all() and len(layers[UNDERLAY].block) > 0


def test_the_same_tiles_give_the_same_bytes(bundle, tiles, tmp_path):
    again = write(tiles, tmp_path / "b")
    for file in ["davgswt.json", *(part.file for part in bundle.manifest.parts)]:
        assert (again.folder / file).read_bytes() == (bundle.folder / file).read_bytes(), file


def test_a_set_without_recipes_has_the_same_tiles_as_records(bundle, tiles, tmp_path):
    plain = write(replace(tiles, recipe=None), tmp_path / "b")
    assert plain.manifest.composition is None
    assert [part.kind for part in plain.manifest.parts] == ["records"] * LEVELS
    size = [sum(part.bytes for part in each.manifest.parts) for each in (bundle, plain)]
    assert size[0] < size[1] / 2
    for level in range(LEVELS):
        composed, stored = (each.chunk(9, level) for each in (bundle, plain))
        assert len(composed) == len(stored)


def test_heights_and_places_at_the_ends_of_the_grid_do_not_wrap():
    place = np.array([[0, 0, 2], [10, 10, 65533]], np.uint16)
    same, colours = np.full((2, 3), 127, np.uint8), np.array([[-9, 0, 250], [255, 264, 5]], np.int16)
    layer = Layer(np.array([0, 2]), Block(place, same, same, colours, same[:, 0]))
    for change, heights, shown in (
        (-5, [0, 65528], [[0, 0, 245], [250, 255, 0]]),
        (5, [7, 65535], [[0, 5, 255], [255, 255, 10]]),
    ):
        recipe = TileRecipe(np.array([[0]]), np.full((4, 1, 1), change, np.int16))
        rows, ground = compose_records([layer], recipe, (65000, 3), 10)
        assert rows["position"].tolist() == [[65000, 3, heights[0]], [65010, 13, heights[1]]]
        assert rows["rgba"][:, :3].tolist() == shown and ground.all()
