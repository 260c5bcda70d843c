from dataclasses import replace

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.lod import merge
from dav_gswt.reconstruction import discs, ground

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


def test_a_ground_without_objects_merges_whatever_the_degree_of_its_harmonics(scene):
    field, grid = scene
    bare = field[field.ground]
    bare = replace(bare, sh=np.concatenate([bare.sh, np.zeros((len(bare), 3, 3), np.float32)], 1))
    half, coarse = merge.halve_resolution(*merge.crop_to_blocks(bare, grid, 8))
    assert half.ground.sum() == coarse.heights.size and half.sh.shape[1] == 1
