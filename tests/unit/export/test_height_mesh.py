"""Triangles of a height field: none is off by more than stated, none overlaps, no crack, no more than needed."""

import numpy as np
import pytest

from dav_gswt.export.height_mesh import simplify_heights

BLOCK = 16


def rough():
    y, x = np.mgrid[: 2 * BLOCK + 1, : 3 * BLOCK + 1]
    wave = np.sin(x / 9) * np.cos(y / 7)
    return (wave + 0.02 * np.random.default_rng(0).normal(size=x.shape)).astype(np.float32)


def fill(heights, points, triangles):
    """Heights of the triangles at all lattice points; fails where two triangles disagree on one."""
    found, area = np.full(heights.shape, np.nan), 0.0
    for corners in points[triangles]:
        (r, c), z = corners.T, heights[tuple(corners.T)].astype(float)
        twice = (c[1] - c[0]) * (r[2] - r[0]) - (c[2] - c[0]) * (r[1] - r[0])
        assert twice > 0  # counter-clockwise from above
        area += twice / 2
        rows, columns = np.mgrid[r.min() : r.max() + 1, c.min() : c.max() + 1].reshape(2, -1)
        weights = np.linalg.solve(np.array([c, r, np.ones(3)], float), [columns, rows, np.ones(len(rows))])
        inside = (weights > -1e-9).all(0)
        place, value = (rows[inside], columns[inside]), z @ weights[:, inside]
        assert np.nanmax(np.abs(found[place] - value), initial=0) < 1e-5
        found[place] = value
    assert area == (heights.shape[0] - 1) * (heights.shape[1] - 1)
    return found


@pytest.mark.parametrize("tolerance", [0.0, 0.05, 0.2, 0.6])
def test_no_point_is_off_by_more_than_the_tolerance(tolerance):
    heights = rough()
    points, triangles = simplify_heights(heights, BLOCK, tolerance)
    assert np.abs(fill(heights, points, triangles) - heights).max() <= tolerance + 1e-6


def test_larger_tolerances_need_fewer_triangles_and_a_plane_two_a_block():
    counts = [len(simplify_heights(rough(), BLOCK, tolerance)[1]) for tolerance in (0.0, 0.02, 0.1, 0.5, 5.0)]
    assert counts == sorted(counts, reverse=True) and counts[0] == 2 * 32 * 48 and counts[-1] == 2 * 6
    y, x = np.mgrid[: BLOCK + 1, : 2 * BLOCK + 1]
    points, triangles = simplify_heights((0.5 * x - 0.25 * y).astype(np.float32), BLOCK, 1e-5)
    assert len(triangles) == 4 and len(points) == 6
