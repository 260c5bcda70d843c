"""Coarser levels merged from a tile's own cells: means, counts, brightness, borders."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.tile_sets import splats

from dav_gswt.field import concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.reconstruction import discs, underlay
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import build, coarse_levels

CELLS, SPACING = 16, 0.25


@pytest.fixture
def tile():
    """A slope with random colours, an underlay and things, in no order."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid((np.arange(CELLS) + 0.5) * SPACING, (np.arange(CELLS) + 0.5) * SPACING)
    grid = Ground(0.0, 0.0, SPACING, 0, 0, CELLS, 0.2 * x - 0.1 * y, np.ones((CELLS, CELLS), bool))
    layer = discs.make_ground_discs(grid, rng.uniform(0.2, 0.8, (CELLS**2, 3)))
    layer = replace(layer, uncertainty=rng.random(CELLS**2).astype(np.float32))
    things = splats(rng.random((200, 3)) * CELLS * SPACING, rng.random((200, 3)), [0.02, 0.02, 0.05], False)
    whole = concatenate_fields([layer, underlay.make_underlay(grid, layer), things])
    return whole[rng.permutation(len(whole))]


def test_four_discs_become_one_of_their_means(tile):
    half = coarse_levels.merge_cells(tile, CELLS, SPACING)
    flat, fine = half[half.ground], tile[tile.ground]
    assert len(flat) == CELLS**2 // 4
    for disc in (0, 9, 37):
        x, y = flat.means[disc, :2]
        under = (np.abs(fine.means[:, :2] - [x, y]) < SPACING).all(1)
        assert under.sum() == 4
        for values in (lambda f: f.base_colours, lambda f: f.means, lambda f: f.uncertainty):
            np.testing.assert_allclose(values(flat)[disc], values(fine)[under].mean(0), atol=1e-5)
        sizes = fine.log_scales[under, :2].mean()
        np.testing.assert_allclose(flat.log_scales[disc, :2], sizes + np.log(2), atol=1e-5)


def test_the_underlay_is_renewed_and_nothing_else_is_taken_for_it(tile):
    assert coarse_levels.find_underlay(tile, SPACING).sum() == CELLS**2 // 4
    half = coarse_levels.merge_cells(tile, CELLS, SPACING)
    assert coarse_levels.find_underlay(half, 2 * SPACING).sum() == CELLS**2 // 16
    bare = coarse_levels.merge_cells(tile[~coarse_levels.find_underlay(tile, SPACING)], CELLS, SPACING)
    assert not coarse_levels.find_underlay(bare, 2 * SPACING).any() and bare.ground.sum() == half.ground.sum()


def test_each_level_is_a_coarser_and_smaller_one_as_bright_as_the_one_before(tile):
    """From above, over the middle: a disc shows the mean of what it covers."""
    camera = cameras.top_down(0.5, 0.5, 48, 48, 3.0 / 48, 50.0)
    means, counts, scales = [], [], []
    # things hide ground by chance: brightness is compared without them
    level = tile[tile.ground | coarse_levels.find_underlay(tile, SPACING)]
    for number in range(3):
        seen = Rasterizer().forward(**to_raster_arrays(level), camera=camera)
        means.append((seen.colour / seen.alpha[..., None]).mean((0, 1)))
        counts.append(len(level))
        scales.append(np.exp(level.log_scales.astype(float)).mean())
        level = coarse_levels.merge_cells(level, CELLS >> number, SPACING * 2**number)
    assert scales[0] < scales[1] < scales[2] and counts[0] == 4 * counts[1] == 16 * counts[2]
    # uniform noise of 0.17 a disc, averaged over 12 x 12: 0.015 at three standard deviations with the rim's share
    np.testing.assert_allclose(means, [means[0]] * 3, atol=0.015)


def test_a_cell_without_a_disc_stays_empty(tile):
    inside = (tile.means[:, :2] < 2 * SPACING).all(1) & tile.ground
    half = coarse_levels.merge_cells(tile[~inside], CELLS, SPACING)
    assert half.ground.sum() == CELLS**2 // 4 - 1 and np.isfinite(half.means).all()


@pytest.mark.parametrize("cells", [7, 2, 0])
def test_cells_that_do_not_halve_are_refused(tile, cells):
    with pytest.raises(ValueError, match=f"{cells} cells"):
        coarse_levels.merge_cells(tile, cells, SPACING)


@pytest.fixture(scope="module")
def five(sample_ground):
    """Tiles at five levels, of which the exemplar gives three."""
    options = build.TilingOptions(share=0.5, strip=0.17, candidates=20, tries=1, levels=5)
    return build.cut_tiles(
        sample_ground.levels,
        sample_ground.exemplar,
        sample_ground.colour,
        np.zeros((96, 96)),
        options,
        np.random.default_rng(2),
    )


def test_tiles_go_on_where_the_exemplar_ends(five, tiles):
    assert five.report.layout.levels == 5 and five.report.layout.composed_levels == 3
    assert five.side == tiles.side
    scales = [[float(np.exp(f.log_scales).mean()) for f in level] for level in five.fields]
    assert (np.diff(scales, axis=0) > 0).all()
    for level, fields in enumerate(five.fields):
        n = 48 >> level
        for field in fields:
            x, y = np.floor(field[field.ground].means[:, :2] / (five.spacing * 2**level)).astype(int).T
            np.testing.assert_array_equal(np.bincount(y * n + x, minlength=n * n), 1)
            assert (field.means[:, :2] >= 0).all() and (field.means[:, :2] <= np.float32(five.side)).all()
