import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt import field as field_module
from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.lod import build, merge, store
from dav_gswt.lod.levels import AUTO, Levels
from dav_gswt.raster import render
from dav_gswt.reconstruction.discs import find_underlay
from dav_gswt.reconstruction.objects import make_blobs


@pytest.fixture(scope="module")
def levels():
    field, grid = merge.crop_to_blocks(made.field(), made.grid(), 4)
    coarse = build.fit_coarser_level(field, grid, 12, np.random.default_rng(0))
    return (field, grid), coarse


def test_a_coarser_level_has_a_quarter_of_the_discs_and_a_larger_mean_scale(levels):
    (field, grid), (level, coarse) = levels
    assert 4 * len(level) == len(field)
    assert coarse.exemplar == pytest.approx(grid.exemplar)
    assert np.exp(level.log_scales).mean() > 1.5 * np.exp(field.log_scales).mean()


def test_discs_keep_the_mean_heights_of_what_they_cover():
    field, grid = merge.crop_to_blocks(made.field(), made.grid(), 4)
    hills = 0.1 * np.sin(5 * grid.centres[:, 0])
    n = grid.heights.size
    means = field.means.copy()
    means[:n, 2] += hills.astype(np.float32)
    grid = replace(grid, heights=grid.heights + hills.reshape(grid.shape))
    level, coarse = build.fit_coarser_level(replace(field, means=means), grid, 5, np.random.default_rng(0))
    rows, columns = coarse.shape
    four = grid.heights.reshape(rows, 2, columns, 2).mean((1, 3))
    np.testing.assert_allclose(level.means[: four.size, 2].reshape(four.shape), four, atol=1e-6)


def test_a_level_is_as_uncertain_as_what_it_was_merged_from():
    """So are the objects, of which the fit drops one, and the underlay."""
    field, grid = merge.crop_to_blocks(made.field(), made.grid(), 4)
    places, sizes = np.array([[1.0, 1.0, 0.1], [1.5, 1.5, -2.0], [2.0, 2.0, 0.1]]), np.full(3, 0.1)
    things = replace(make_blobs(places, np.full((3, 3), 0.5), sizes), uncertainty=np.float32([0.25, 0.5, 0.75]))
    discs = field.ground
    east = np.where(discs, field.means[:, 0] / 3.2, 0).astype(np.float32)
    field = field_module.concatenate_fields([replace(field, uncertainty=east), things])
    level, coarse = build.fit_coarser_level(field, grid, 5, np.random.default_rng(0))
    n = coarse.heights.size
    np.testing.assert_allclose(level.uncertainty[:n], coarse.centres[:, 0] / 3.2, atol=1e-6)
    assert level.uncertainty[-2:].tolist() == [0.25, 0.75]  # the one below the ground is gone
    under = find_underlay(level, coarse)
    np.testing.assert_allclose(level.uncertainty[under], level.means[under, 0] / 3.2, atol=0.07)  # a coarse cell's


def test_levels_are_fitted_while_the_exemplar_has_room():
    field, grid = made.field(), made.grid()
    made_levels = build.build_levels(field, grid, AUTO, 3, seed=0)
    widths = [g.cells for g in made_levels.grids]
    assert widths == [grid.cells >> number for number in range(len(widths))] and len(widths) > 1
    assert widths[-1] < 2 * build.MIN_CELLS and made_levels.wanted == AUTO
    scales = [field_module.mean_scale([f]) for f in made_levels.fields]
    assert scales == sorted(scales) and "tiles make it" in made_levels.stopped
    two = build.build_levels(field, grid, 2, 3, seed=0)
    assert len(two.fields) == 2 and two.wanted == 2


def test_levels_that_were_written_read_back(levels, tmp_path):
    fields, grids = zip(*levels, strict=True)
    store.write_levels([Levels(list(fields), list(grids), AUTO, "why")], tmp_path / "levels", {})
    back = store.read_levels(tmp_path / "levels")
    assert back.wanted == AUTO and back.stopped == "why" and len(back.fields) == 2
    np.testing.assert_array_equal(back.fields[1].means, fields[1].means)
    assert back.grids[1].spacing == grids[1].spacing
    field_module.write_field(fields[0], tmp_path / "levels/level1.ply")
    with pytest.raises(InputError, match="levels.json lists"):
        store.read_levels(tmp_path / "levels")


@pytest.mark.parametrize("content", [[], 7, {"levels": []}, {"levels": "ab"}, {"levels": [{}]}])
def test_a_table_that_is_none_is_refused_by_name(tmp_path, content):
    (tmp_path / "levels.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="levels.json: not a table of levels"):
        store.read_levels(tmp_path)


def test_from_afar_a_coarser_level_looks_like_its_finer_neighbour(levels):
    (field, _), (level, _) = levels
    camera = cameras.pinhole([1.6, -12.0, 14.0], [1.6, 1.6, 0], 64, 64, 12.0)
    a, b = render(field, camera), render(level, camera)
    solid = (a.alpha > 0.95) & (b.alpha > 0.95)
    assert solid.mean() > 0.2
    assert np.abs(a.colour - b.colour)[solid].mean() < 0.03


def test_a_finished_field_gets_a_ground_on_its_first_coarser_level():
    field, grid = made.field(), made.grid()
    finished = replace(field, ground=np.zeros(len(field), bool))
    half, coarse = merge.halve_resolution(*merge.crop_to_blocks(finished, grid, 2))
    assert half.ground.sum() == coarse.heights.size
    inner = np.arange(coarse.heights.size).reshape(coarse.shape)[2:-2, 2:-2].ravel()
    true = made.look(*half.means[inner, :2].T)
    assert np.abs(half.base_colours[inner] - true).mean() < 0.03
