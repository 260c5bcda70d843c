"""Visible cells: conservative culling, back-to-front order, levels by distance, budget."""

import numpy as np
import pytest
from fixtures.terrains import SIDE, walking

from dav_gswt.terrain import visibility


def met_by_rays(surface, camera, reach):
    """Cells whose ground a ray through some pixel meets within reach: the slow way, in small steps along each."""
    origin, step = (a.reshape(-1, 3) for a in camera.rays())
    step = step / np.linalg.norm(step, axis=1, keepdims=True)
    t = np.arange(0.05, reach, 0.01)
    met = set()
    for o, s in zip(origin, step, strict=True):
        at = o + t[:, None] * s
        under = np.flatnonzero(at[:, 2] < surface.at(at[:, 0], at[:, 1])[0])
        if len(under):
            met.add(tuple(np.floor(at[under[0], :2] / SIDE).astype(int).tolist()))
    return met


@pytest.mark.parametrize("pitch, height", [(12.0, 3.0), (-10.0, 1.0), (60.0, 1.0), (89.0, 9.0)])
@pytest.mark.parametrize("surface", ["terrain", "hilly"])
def test_what_the_camera_sees_is_there(request, surface, pitch, height):
    shown = request.getfixturevalue(surface)
    camera = walking(shown, pitch, height, size=(24, 14))
    cells = visibility.visible_cells(shown, camera)
    assert met_by_rays(shown.heights, camera, shown.reach * SIDE) <= set(
        zip(cells.i.tolist(), cells.j.tolist(), strict=True)
    )


def test_what_is_out_of_sight_is_not_there(terrain):
    cells = visibility.visible_cells(terrain, walking(terrain))
    assert len(cells) < 0.3 * (2 * terrain.reach + 1) ** 2
    ahead = np.array([np.cos(np.radians(60)), np.sin(np.radians(60))])
    middle = np.stack([cells.i + 0.5, cells.j + 0.5], 1) * SIDE - 2.0
    assert (middle @ ahead > -2 * SIDE).all()


def test_cells_come_back_to_front_and_the_nearest_nine_are_marked(terrain):
    cells = visibility.visible_cells(terrain, walking(terrain, 60.0, 9.0))
    steps = np.abs(cells.i) + np.abs(cells.j)
    assert (np.diff(steps) <= 0).all() and steps[-1] == 0
    assert set(zip(cells.i[cells.close].tolist(), cells.j[cells.close].tolist(), strict=True)) <= {
        (i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)
    }


def test_levels_follow_the_distance(terrain):
    camera = walking(terrain)
    cells = visibility.visible_cells(terrain, camera)
    levels = visibility.active_levels(terrain, cells)
    assert (levels[0] == (cells.nearest <= 22)).all() and (levels[1] == (cells.farthest >= 18)).all()
    assert (levels.all(0)).any() and levels.any(0).all()


def test_too_many_gaussians_go_farthest_first(terrain):
    cells = visibility.visible_cells(terrain, walking(terrain))
    few = visibility.drop_far_cells(terrain, cells, 20_000)
    assert 0 < len(few) < len(cells)
    gone = ~np.isin(cells.i * 1000 + cells.j, few.i * 1000 + few.j)
    assert few.nearest.max() <= cells.nearest[gone].min()
    assert (np.diff(np.abs(few.i) + np.abs(few.j)) <= 0).all(), "and the order stays"
