"""The sphere: its bend in float32 and float64, neighbours by geometry, walks; cells in view, their order and edges."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dav_gswt.terrain.ground_mapping import camera_on
from dav_gswt.terrain.sphere_edges import is_covered
from fixtures.terrains import two_level_terrain
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.errors import InputError
from dav_gswt.terrain import sphere, sphere_cells, sphere_edges
from dav_gswt.terrain.choice import tiles_at
from dav_gswt.terrain.sphere import EAST, FACES, NORTH, SOUTH, WEST, Sphere, bend, directions, make_sphere

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "sphere.json").read_text())
ORDERS = GOLDEN["orders"]
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


@pytest.mark.parametrize("radius", [1.0, 40.0, 1e7])
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


@pytest.mark.parametrize("n", [2, 5])
def test_the_cell_beyond_each_edge_is_the_one_that_lies_there(n):
    ball = Sphere(n * SIDE / 1.4, SIDE, n)
    for face in range(6):
        for i, j in np.ndindex(n, n):
            for side, (di, dj) in STEPS.items():
                over = np.array([[i + 0.5 + 0.501 * di, j + 0.5 + 0.501 * dj]])
                there, place = sphere.locate(ball, directions(np.array([face]), ball.tangents(*over.T)))
                found = sphere.step_cell(ball, face, i, j, side)
                assert found[:3] == (int(there[0]), *np.floor(place[0]).astype(int).tolist())
                assert sphere.step_cell(ball, *found[:3], _back(found[3], side))[:3] == (face, i, j)


def _back(turns, side):
    """The side of the neighbour that leads back: the opposite one, turned against the turn of its axes."""
    around = [EAST, NORTH, WEST, SOUTH]
    return around[(around.index(side) + 2 - turns) % 4]


def test_a_straight_walk_crosses_edges_and_corners_without_a_jump():
    begin = sphere.frame_at(10.0, 12.0)
    for way in ([0.0, 1.0], [0.8, 0.6], [-0.3, 0.95], [1.0, 1.0]):
        way = np.array(way) / np.hypot(*way)
        frames = [sphere.walk_from(begin, way * step, 10.0) for step in range(63)]
        for frame, after in zip(frames, frames[1:], strict=False):
            np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
            assert np.abs(after - frame).max() < 0.101  # a tenth of a radian
        np.testing.assert_allclose(sphere.walk_from(begin, way * 2 * np.pi * 10.0, 10.0), begin, atol=1e-12)


def test_frames_are_east_north_and_up_also_at_the_poles():
    np.testing.assert_allclose(sphere.frame_at(0.0, 0.0), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-15)
    for latitude in (90.0, -90.0, 89.999999):
        frame = sphere.frame_at(33.0, latitude)
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1)


def test_several_materials_and_objects_are_refused():
    sphere.require_plain_cover("flat", {}, [1])
    sphere.require_plain_cover("sphere", None, [])
    for cover, what in (((None, [1]), "objects"), (([1], None), "several materials")):
        with pytest.raises(InputError, match=f"{what}: give the scene `materials: one`"):
            sphere.require_plain_cover("sphere", *cover)


@pytest.mark.parametrize("entry", GOLDEN["spheres"], ids=lambda e: str(e["cells"]))
def test_bends_are_those_shared_with_the_page(entry):
    ball = make_sphere(entry["radius"] / entry["side"], entry["side"])
    assert ball.cells == entry["cells"]
    for one in entry["bends"]:
        local, tangents = np.array([one["local"]]), tangents_of(ball, one["i"], one["j"])
        points, jacobian = bend(local, tangents, ball.radius, ball.rate)
        np.testing.assert_allclose(points[0], one["point"], atol=1e-9)
        np.testing.assert_allclose(jacobian[0], one["jacobian"], atol=1e-12)


def all_cells(ball: Sphere):
    face, i, j = (v.ravel() for v in np.mgrid[:6, -1 : ball.cells + 1, -1 : ball.cells + 1])
    covered = is_covered(ball, face, i, j)
    return face[covered], i[covered], j[covered]


@pytest.fixture(scope="module")
def planet():
    return replace(two_level_terrain(), heights=make_sphere(8.0, 4.0), reach=48)


@pytest.mark.parametrize("view", ORDERS["views"], ids=lambda v: str(v["eye"]))
def test_cells_stand_in_the_order_shared_with_the_page(view):
    ball = Sphere(ORDERS["radius"], ORDERS["side"], ORDERS["cells"])
    face, i, j = all_cells(ball)
    order, close = sphere_cells.sort_on_sphere(ball, face, i, j, np.array(view["eye"], float))
    assert np.stack([face, i, j], 1)[order].tolist() == view["order"]
    assert close[order].tolist() == view["close"]


@given(st.floats(-180, 180), st.floats(-90, 90), st.floats(0.01, 3), st.floats(-180, 180), st.floats(0, 1))
@settings(max_examples=30)
def test_no_ray_meets_a_cell_before_one_that_is_drawn_after_it(longitude, latitude, height, yaw, down):
    """The slow way: walk along a ray through the shell of tiles and note the cells in the order that it enters them."""
    ball, axes = make_sphere(6.0, 1.0), sphere.frame_at(longitude, latitude)
    eye = (ball.radius + height) * axes[2]
    face, i, j = (v.ravel() for v in np.mgrid[:6, : ball.cells, : ball.cells])
    order, close = sphere_cells.sort_on_sphere(ball, face, i, j, eye)
    place = {(int(face[k]), int(i[k]), int(j[k])): at for at, k in enumerate(order)}
    near = {(int(face[k]), int(i[k]), int(j[k])) for k in np.flatnonzero(close)}
    dip = np.arccos(ball.radius / (ball.radius + height))
    pitch = -dip - down * (0.5 * np.pi - dip)
    turn = np.radians(yaw)
    way = np.array([np.cos(pitch) * np.cos(turn), np.cos(pitch) * np.sin(turn), np.sin(pitch)]) @ axes
    points = eye + np.arange(0, 8, 2e-3)[:, None] * way
    points = points[np.linalg.norm(points, axis=1) >= ball.radius - 0.3]
    faces, places = sphere.locate(ball, points)
    met = np.concatenate([faces[:, None], np.floor(places).astype(int)], 1)
    entered = [(int(f), int(a), int(b)) for f, a, b in met[np.r_[True, (np.diff(met, axis=0) != 0).any(1)]]]
    drawn = [place[cell] for cell in entered if cell not in near]  # those are sorted by depth
    assert drawn == sorted(drawn, reverse=True)


@pytest.mark.parametrize("height, point", [(0.3, (1, 1, 1)), (3.0, (-1, -1, 0)), (60.0, (0.3, -0.9, 1))])
def test_no_cell_of_which_something_shows_is_lost(planet, point, height):
    ball, up = planet.heights, np.array(point) / np.linalg.norm(point)
    longitude, latitude = np.degrees([np.arctan2(up[1], up[0]), np.arcsin(up[2])])
    axes = sphere.frame_at(longitude, latitude)
    for yaw, pitch in ((20.0, -5.0), (200.0, -40.0), (0.0, -89.0)):
        camera = camera_on((ball.radius + height) * axes[2], axes, yaw, pitch, 64, 36)
        cells = sphere_cells.visible_on_sphere(planet, ball, camera)
        found = set(zip(*(v.tolist() for v in (*ball.split_column(cells.i), cells.j)), strict=True))
        assert len(found) == len(cells)
        face, i, j = all_cells(ball)
        steps = np.linspace(0, 1, 5)
        a, b = (v.ravel() for v in np.meshgrid(steps, steps))
        for z in (0.0, planet.z[1]):
            for k in range(len(a)):
                points = (ball.radius + z) * directions(face, ball.tangents(i + a[k], j + b[k]))
                pixels, depth = camera.project(points)
                inside = ((pixels >= 0) & (pixels < [64, 36])).all(1) & (depth > planet.near)
                square = ((points - camera.centre) ** 2).sum(1)
                ahead = square < height * (2 * ball.radius + height)  # before the horizon
                for row in np.flatnonzero(inside & ahead).tolist():
                    assert (int(face[row]), int(i[row]), int(j[row])) in found
        assert (cells.nearest <= cells.farthest).all()


def tile(ball, face, i, j, salt=7, variants=2):
    cell = [np.array([v]) for v in (face, i, j)]
    return int(sphere_edges.tiles_on(ball, cell[0], cell[1], cell[2], salt, variants)[0])


@pytest.mark.parametrize("salt", [0, 7])
def test_colours_agree_across_every_edge_without_a_turn(salt):
    ball, crossed = make_sphere(4.0, 4.0), 0
    cells = np.mgrid[:6, : ball.cells, : ball.cells].reshape(3, -1)
    for side, (here, there) in {EAST: (1, 3), NORTH: (2, 0)}.items():
        beyond = np.array([sphere.step_cell(ball, *cell, side) for cell in cells.T.tolist()]).T
        straight = beyond[3] == 0
        crossed += (beyond[0] != cells[0])[straight].sum()
        mine, other = (sphere_edges.tiles_on(ball, *some[:3, straight], salt, 2) for some in (cells, beyond))
        assert ((mine >> here & 1) == (other >> there & 1)).all()
    assert crossed == 6 * ball.cells


def test_without_a_period_tiles_are_those_of_the_plane():
    i, j = np.meshgrid(np.arange(-20, 20), np.arange(-20, 20))
    assert (tiles_at(i, j, 3, 2, 10**9) == tiles_at(i, j, 3, 2)).sum() >= 800  # all but those below the first lap
    assert (tiles_at(i + 12, j + 12, 3, 2, 12) == tiles_at(i, j, 3, 2, 12)).all()


def count_owners(ball: Sphere, points, salt: int):
    """How many faces' tilings show each place on the ground, over and beyond their edges."""
    owners = np.zeros(len(points), int)
    for face, (east, north, out) in enumerate(FACES):
        ahead = np.flatnonzero(points @ out > 0.1)
        tangents = points[ahead] @ np.stack([east, north], 1) / (points[ahead] @ out)[:, None]
        at = (np.arctan(tangents) / sphere.QUARTER + 0.5) * ball.cells
        cells = [np.full(len(at), face), *np.floor(at).astype(np.int64).T]
        covered, frayed = is_covered(ball, *cells), sphere_edges.is_frayed(ball, *cells)
        places = np.concatenate([at, np.zeros((len(at), 1))], 1)
        stays = sphere_edges.find_kept(ball, face, places, salt)
        owners[ahead] += covered & (~frayed | stays)
    return owners


@pytest.mark.parametrize("radius", [4.0, 40.0])
def test_each_place_belongs_to_one_face_also_at_edges_and_corners(radius):
    ball, rng = make_sphere(radius, 4.0), np.random.default_rng(5)
    anywhere = rng.normal(size=(3000, 3))
    corners = rng.choice([-1, 1], (3000, 3)) + 0.5 / radius * rng.normal(size=(3000, 3))
    edges = rng.choice([-1, 1], (3000, 3)) + 0.3 / radius * rng.normal(size=(3000, 3))
    edges[np.arange(3000), rng.integers(0, 3, 3000)] = rng.uniform(-1, 1, 3000)
    points = np.concatenate([anywhere, corners, edges])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for salt in (0, 7):
        assert (count_owners(ball, points, salt) == 1).all()


@pytest.mark.parametrize("entry", GOLDEN["spheres"], ids=lambda e: str(e["cells"]))
def test_tiles_and_what_stays_are_those_shared_with_the_page(entry):
    ball = make_sphere(entry["radius"] / entry["side"], entry["side"])
    for one in entry["tiles"]:
        assert tile(ball, one["face"], one["i"], one["j"], entry["salt"], entry["variants"]) == one["tile"]
    for one in entry["kept"]:
        places = np.array([one["place"]])
        assert sphere_edges.find_kept(ball, one["face"], places, entry["salt"])[0] == one["stays"]
