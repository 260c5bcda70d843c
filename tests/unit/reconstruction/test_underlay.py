from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.raster import render
from dav_gswt.reconstruction import underlay


def test_a_field_has_its_underlay_after_its_discs_and_no_thing_is_lost_with_it():
    grid, field = made.grid(), made.field()
    assert underlay.find_rows(field, grid) == slice(
        grid.heights.size, grid.heights.size + underlay.count_gaussians(grid)
    )
    alone = underlay.remove_underlay(field, grid)
    assert alone.ground.all() and len(alone) == grid.heights.size
    assert underlay.find_rows(alone, grid).stop == grid.heights.size


def test_a_finished_field_with_fewer_gaussians_than_cells_has_no_underlay_to_lose():
    grid, field = made.grid(), made.field()
    few = replace(field, ground=np.zeros(len(field), bool))[: grid.heights.size // 2]
    assert underlay.remove_underlay(few, grid) is few


def test_no_sky_shines_through_the_ground_between_shrunken_discs():
    grid, field = made.grid(), made.field()
    scales = field.log_scales.copy()
    scales[: grid.heights.size, :2] = np.log(0.2 * grid.spacing)
    grains = replace(field, log_scales=scales)
    camera = cameras.pinhole([1.6, 0.0, 0.8], [1.6, 1.6, 0], 96, 96, 40.0)
    inside = mask_outside_ground(
        TrainingView("", camera, np.zeros((96, 96, 3), np.float32), np.ones((96, 96), np.float32)),
        0.4,
        0.4,
        2.8,
        2.8,
    )
    counts = inside.weight > 0
    assert render(underlay.remove_underlay(grains, grid), camera).alpha[counts].min() < 0.5  # there were holes
    assert render(grains, camera).alpha[counts].min() > 0.95
