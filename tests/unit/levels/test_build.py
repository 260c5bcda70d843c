import made_up_ground as made
import numpy as np
import pytest

from dav_gswt import cameras
from dav_gswt.levels import build, merge
from dav_gswt.raster import render


@pytest.fixture(scope="module")
def levels():
    field, grid = merge.cropped(made.field(), made.grid(), 4)
    coarse = build.coarser(field, grid, 12, np.random.default_rng(0))
    return (field, grid), coarse


def test_a_coarser_level_has_a_quarter_of_the_discs_and_a_larger_mean_scale(levels):
    (field, grid), (level, coarse) = levels
    assert 4 * len(level) == len(field)
    assert coarse.exemplar == pytest.approx(grid.exemplar)
    assert np.exp(level.log_scales).mean() > 1.5 * np.exp(field.log_scales).mean()


def test_from_afar_a_coarser_level_looks_like_its_finer_neighbour(levels):
    (field, _), (level, _) = levels
    camera = cameras.pinhole([1.6, -12.0, 14.0], [1.6, 1.6, 0], 64, 64, 12.0)
    a, b = render(field, camera), render(level, camera)
    solid = (a.alpha > 0.95) & (b.alpha > 0.95)
    assert solid.mean() > 0.2
    assert np.abs(a.colour - b.colour)[solid].mean() < 0.03


def test_a_finished_field_gets_a_ground_on_its_first_coarser_level():
    from dataclasses import replace

    field, grid = made.field(), made.grid()
    finished = replace(field, ground=np.zeros(len(field), bool))
    half, coarse = merge.halved(*merge.cropped(finished, grid, 2))
    assert half.ground.sum() == coarse.heights.size
    inner = np.arange(coarse.heights.size).reshape(coarse.shape)[2:-2, 2:-2].ravel()
    true = made.look(*half.means[inner, :2].T)
    assert np.abs(half.base_colours[inner] - true).mean() < 0.03
