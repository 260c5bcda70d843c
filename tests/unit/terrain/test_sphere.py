"""The sphere: the bend in float32 and float64, its derivative, neighbours by geometry, distortion, straight walks."""

import json
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.terrain import sphere
from dav_gswt.terrain.sphere import EAST, FACES, NORTH, SOUTH, WEST, Sphere, bend, directions, make_sphere, step_cell

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "sphere.json").read_text())["spheres"]
STEPS = {WEST: (-1, 0), EAST: (1, 0), SOUTH: (0, -1), NORTH: (0, 1)}
SIDE = 4.0


def cells_at_rims(n):
    """Cells of a face at its corners, at the middles of its edges, in its middle, and a few others."""
    some = sorted({0, 1 % n, n // 3, n // 2, n - 1})
    return [(i, j) for i in some for j in some]


def tangents_of(ball: Sphere, i, j):
    return ball.tangents(np.array(i + 0.5), np.array(j + 0.5))


def exactly(ball: Sphere, i, j, local):
    """Where points of a tile go, from the tile's middle, in 80 bits and straight from the definition."""
    long = np.longdouble
    quarter = 2 * np.arctan(long(1))

    def place(x, y, z):
        angles = [((k + long(0.5) + v / long(SIDE)) / ball.cells - long(0.5)) * quarter for k, v in ((i, x), (j, y))]
        ray = np.stack([np.tan(angles[0]), np.tan(angles[1]), np.ones_like(angles[0])], -1)
        return ray / np.sqrt((ray * ray).sum(-1, keepdims=True)) * (long(ball.radius) + z)[..., None]

    points = local.astype(long)
    return place(*points.T) - place(*np.zeros((3, 1), long))


@pytest.mark.parametrize("radius", [1.0, 4.0, 40.0, 1e3, 1e5, 1e7])
def test_float32_keeps_its_digits_at_every_edge_and_corner(radius):
    ball, rng = make_sphere(radius, SIDE), np.random.default_rng(3)
    ends = np.array([[x, y, 0] for x in (-2.0, 0, 2.0) for y in (-2.0, 0, 2.0)])
    local = np.concatenate([ends, rng.uniform(-2, 2, (20, 3)) * [1, 1, 0.2]])
    for i, j in cells_at_rims(ball.cells):
        expected, tangents = exactly(ball, i, j, local), tangents_of(ball, i, j)
        double, _ = bend(local, tangents, ball.radius, ball.rate)
        single, jacobian = bend(local.astype(np.float32), tangents.astype(np.float32), ball.radius, ball.rate)
        assert single.dtype == jacobian.dtype == np.float32
        # the 80 bits of `exactly` are those of the radius: 1e-19 of 4e7 units
        np.testing.assert_allclose(double, expected.astype(float), rtol=0, atol=1e-11)
        np.testing.assert_allclose(single, expected.astype(float), rtol=0, atol=2e-6)  # of a tile 4 wide: 3 float steps


@pytest.mark.parametrize("radius", [4.0, 1e7])
def test_the_derivative_is_that_of_differences(radius):
    ball, rng = make_sphere(radius, SIDE), np.random.default_rng(4)
    local, step = rng.uniform(-2, 2, (12, 3)), 1e-5 if radius < 1e3 else 1e-3  # 80 bits of 4e7 units are 4e-12
    for i, j in cells_at_rims(ball.cells):
        _, jacobian = bend(local, tangents_of(ball, i, j), ball.radius, ball.rate)
        moved = [(exactly(ball, i, j, local + step * e) - exactly(ball, i, j, local - step * e)) for e in np.eye(3)]
        np.testing.assert_allclose(jacobian, np.stack(moved, 2).astype(float) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("n", [2, 5, 14])
def test_the_cell_beyond_each_edge_is_the_one_that_lies_there(n):
    ball = Sphere(n * SIDE / 1.4, SIDE, n)
    for face in range(6):
        for i, j in np.ndindex(n, n):
            for side, (di, dj) in STEPS.items():
                over = np.array([[i + 0.5 + 0.501 * di, j + 0.5 + 0.501 * dj]])
                there, place = sphere.locate(ball, directions(np.array([face]), ball.tangents(*over.T)))
                found = step_cell(ball, face, i, j, side)
                assert found[:3] == (int(there[0]), *np.floor(place[0]).astype(int).tolist())
                assert step_cell(ball, *found[:3], _back(found[3], side))[:3] == (face, i, j)


def _back(turns, side):
    """The side of the neighbour that leads back: the opposite one, turned against the turn of its axes."""
    around = [EAST, NORTH, WEST, SOUTH]
    return around[(around.index(side) + 2 - turns) % 4]


def test_turns_are_those_of_the_axes():
    ball = make_sphere(40.0, SIDE)
    n = ball.cells
    for face in range(6):
        for side, (di, dj) in STEPS.items():
            at = np.array([[n / 2 + di * n / 2, n / 2 + dj * n / 2]])
            there, _, turns = sphere.cross_edge(face, side)
            up = directions(np.array([face]), ball.tangents(*at.T))[0]
            east, other = FACES[face, 0].astype(float), FACES[there, 0].astype(float)
            east, other = east - up * (up @ east), other - up * (up @ other)
            turned = np.degrees(np.arctan2(up @ np.cross(east, other), east @ other))
            assert round(turned / 90) % 4 == turns


def test_six_of_the_twelve_edges_join_without_a_turn():
    turns = [sphere.cross_edge(face, side)[2] for face in range(6) for side in range(4)]
    assert turns.count(0) == 12 and turns.count(2) == 0


def test_tiles_are_stretched_by_less_than_a_third():
    """Figures of docs/formats.md: lengths 0.72 to 1.26 of the tile's, areas 0.83 to 1.18, at most 1.74 to 1."""
    ball = make_sphere(200.0, SIDE)
    lengths, areas = [], []
    for i, j in np.ndindex(ball.cells // 2, ball.cells // 2):
        _, jacobian = bend(np.zeros((1, 3)), tangents_of(ball, i, j), ball.radius, ball.rate)
        level = np.linalg.svd(jacobian[0, :, :2], compute_uv=False)
        lengths.append(level)
        areas.append(np.prod(level))
    lengths, areas = np.array(lengths), np.array(areas)
    assert lengths.min() > 0.72 and lengths.max() < 1.26
    assert (lengths[:, 0] / lengths[:, 1]).max() < 1.74
    assert areas.min() > 0.83 and areas.max() < 1.19
    assert areas.mean() == pytest.approx(1, abs=5e-3)


def test_a_straight_walk_crosses_edges_and_corners_without_a_jump():
    begin = sphere.frame_at(10.0, 12.0)
    for way in ([0.0, 1.0], [0.8, 0.6], [-0.3, 0.95], [1.0, 1.0]):
        way = np.array(way) / np.hypot(*way)
        frames = [sphere.walk_from(begin, way * step * 0.1, 10.0) for step in range(629)]
        for frame, after in zip(frames, frames[1:], strict=False):
            np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
            assert np.abs(after - frame).max() < 0.0101  # a hundredth of a radian
        np.testing.assert_allclose(sphere.walk_from(begin, way * 2 * np.pi * 10.0, 10.0), begin, atol=1e-12)


@pytest.mark.parametrize("latitude", [90.0, -90.0, 89.999999])
def test_the_poles_have_a_frame(latitude):
    frame = sphere.frame_at(33.0, latitude)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)


def test_several_materials_and_objects_are_refused():
    sphere.require_plain_cover("flat", {}, [1])
    sphere.require_plain_cover("sphere", None, [])
    with pytest.raises(InputError, match="materials: one"):
        sphere.require_plain_cover("sphere", None, [1])


@pytest.mark.parametrize("entry", GOLDEN, ids=lambda e: str(e["cells"]))
def test_bends_are_those_shared_with_the_page(entry):
    ball = make_sphere(entry["radius"] / entry["side"], entry["side"])
    assert ball.cells == entry["cells"]
    for one in entry["bends"]:
        local, tangents = np.array([one["local"]]), tangents_of(ball, one["i"], one["j"])
        points, jacobian = bend(local, tangents, ball.radius, ball.rate)
        np.testing.assert_allclose(points[0], one["point"], atol=1e-9)
        np.testing.assert_allclose(jacobian[0], one["jacobian"], atol=1e-12)
