"""Placement of cells: distances within the bounds of the cell, opacities faded by distance."""

import numpy as np
from fixtures.terrains import walking

from dav_gswt.reconstruction import discs
from dav_gswt.terrain import placement, visibility


def test_distances_bound_those_of_the_gaussians(hilly):
    camera = walking(hilly)
    cells = visibility.visible_cells(hilly, camera)
    for k in range(0, len(cells), 37):
        field, _ = placement.place_cell(hilly, cells[k : k + 1], camera.centre)
        distance = np.linalg.norm(field.means.astype(float), axis=1)
        assert cells.nearest[k] <= distance.min() + 1e-4 and distance.max() <= cells.farthest[k] + 1e-4


def test_each_gaussian_fades_by_its_own_distance(terrain):
    camera = walking(terrain)
    cells = visibility.visible_cells(terrain, camera)
    k = int(np.flatnonzero(visibility.active_levels(terrain, cells).all(0))[0])
    field, _ = placement.place_cell(terrain, cells[k : k + 1], camera.centre)
    fine = field.log_scales[:, 0] < np.log(0.13)
    distance = np.linalg.norm(field.means.astype(float), axis=1)
    opacity = 1 / (1 + np.exp(-field.opacity_logits.astype(float)))
    share = np.clip(0.5 - (distance - 20) / 4, 0, 1)
    whole = 1 / (1 + np.exp(-discs.OPAQUE))
    np.testing.assert_allclose(opacity, 1 - (1 - whole) ** np.where(fine, share, 1 - share), atol=1e-5)
    assert fine.any() and not fine.all() and (opacity > 0).all()
