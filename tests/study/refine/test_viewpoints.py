"""Places around a cut: all of it is looked at, and neighbours meet."""

import numpy as np
import pytest

from dav_gswt.study.refine import limits, viewpoints
from dav_gswt.tiles.layout import CENTRE, W, edge_colours


def test_every_part_of_a_cut_is_near_a_place():
    labels = np.full((40, 40), W, np.uint8)
    labels[7:30, 9:33] = CENTRE
    found = viewpoints.find_seam_points(labels, 12)
    for y, x in np.argwhere(limits.find_seam(labels)):
        assert (np.abs(found - [x, y]).max(1) < 12).any()
    assert len(found) < 16 and limits.find_seam(labels)[found[:, 1], found[:, 0]].all()
    assert viewpoints.find_seam_points(np.full((40, 40), CENTRE, np.uint8), 12).shape == (0, 2)


@pytest.mark.parametrize("tile", range(32))
def test_edge_colours_meet_all_around_a_tile(tile):
    around = viewpoints.neighbouring_tiles(tile)
    assert around[1, 1] == tile and (around // 16 == tile // 16).all()
    for j in range(3):
        for i in range(3):
            _, north, east, _ = edge_colours(int(around[j, i]))
            assert i == 2 or east == edge_colours(int(around[j, i + 1]))[0]
            assert j == 2 or north == edge_colours(int(around[j + 1, i]))[3]


def test_cameras_look_at_their_middle_from_as_high_as_is_said():
    middle, width = np.array([2.0, 3.0, 0.5]), 4.0
    for azimuth in (0.0, 90.0, 200.0):
        camera = viewpoints.make_camera(middle, width, azimuth, 64)
        pixel, _ = camera.project(middle[None])
        np.testing.assert_allclose(pixel, [[32, 32]], atol=1e-9)
        assert camera.centre[2] - middle[2] == pytest.approx(viewpoints.flying_height(width))
        by = np.array([5.0, -1.0, 0.25])
        np.testing.assert_allclose(viewpoints.shift_camera(camera, by).centre, camera.centre + by, atol=1e-9)
