"""Levels of detail: merged moments, coarser fits, and their files."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made
from fixtures.frames import scene_frame

from dav_gswt import field as field_module
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.lod import build, merge, store
from dav_gswt.lod.store import AUTO, Levels
from dav_gswt.raster import render
from dav_gswt.reconstruction import discs, ground


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


FRAME = scene_frame(exemplar=(0.0, 0.0, 3.2), extent=(-1.0, -1.0, 4.2, 4.2))


@pytest.fixture
def scene():
    grid = ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=8, margin=0.2)
    x, y, _ = grid.centres.T
    grid = replace(grid, heights=(0.1 * x).reshape(grid.shape), seen=np.ones(grid.shape, bool))
    colours = np.stack([x / 10, y / 10, 0 * x + 0.5], 1)
    return concatenate_fields([discs.make_ground_discs(grid, colours), things(3)]), grid


def things(n, seed=0):
    rng = np.random.default_rng(seed)
    return GaussianField(
        rng.uniform(0.5, 2.5, (n, 3)).astype(np.float32),
        np.log(rng.uniform(0.02, 0.06, (n, 3))).astype(np.float32),
        rng.normal(size=(n, 4)).astype(np.float32),
        rng.normal(size=n).astype(np.float32),
        rgb_to_sh(rng.uniform(0, 1, (n, 3))),
        rng.uniform(0, 1, n).astype(np.float32),
        np.zeros(n, bool),
    )


def test_four_discs_become_one_of_their_mean(scene):
    field, grid = merge.crop_to_blocks(*scene, 8)
    half, coarse = merge.halve_resolution(field, grid)
    n = coarse.heights.size
    assert 4 * n == grid.heights.size
    assert coarse.spacing == pytest.approx(2 * grid.spacing)
    assert coarse.exemplar == pytest.approx(grid.exemplar)
    # both colour and height are linear in place, so the mean of four is the value in their middle
    np.testing.assert_allclose(half.base_colours[:n, 0], half.means[:n, 0] / 10, atol=1e-5)
    np.testing.assert_allclose(half.means[:n, 2], 0.1 * half.means[:n, 0], atol=1e-5)
    assert np.exp(half.log_scales).mean() > np.exp(field.log_scales).mean()


def test_merged_moments_are_those_of_the_mixture():
    a = things(2)
    upright = np.tile(np.array([1, 0, 0, 0], np.float32), (2, 1))
    a = replace(a, means=np.array([[0.1, 0, 0], [0.3, 0, 0]], np.float32), quats=upright)
    a = replace(a, log_scales=np.full((2, 3), np.log(0.05), np.float32), opacity_logits=np.zeros(2, np.float32))
    back = merge.merge_by_voxel(a, voxel=1.0)
    np.testing.assert_allclose(back.means, [[0.2, 0, 0]], atol=1e-6)
    # variance along x: 0.05^2 + 0.1^2, across: 0.05^2
    np.testing.assert_allclose(np.diag(merge.compute_covariances(back)[0]), [0.0125, 0.0025, 0.0025], rtol=1e-4)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("change", [{"opacity_logits": -800.0}, {"log_scales": -400.0}], ids=["clear", "tiny"])
def test_gaussians_that_weigh_nothing_are_left_out(change):
    """Alone in their voxel they would be divided by 0."""
    faint = things(2, seed=1)
    faint = replace(faint, **{name: np.full_like(getattr(faint, name), value) for name, value in change.items()})
    faint = replace(faint, means=faint.means + np.float32(10))
    found = merge.merge_by_voxel(concatenate_fields([things(3), faint]), 0.5)
    alone = merge.merge_by_voxel(things(3), 0.5)
    for name, values in vars(alone).items():
        np.testing.assert_array_equal(getattr(found, name), values)
    assert len(merge.merge_by_voxel(faint, 0.5)) == 0
