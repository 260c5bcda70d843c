"""The sphere: its bend, walks; cells in view, their order and edges; pictures without holes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.terrains import MAGENTA, two_level_terrain

from dav_gswt.bundle.manifest import Sky
from dav_gswt.errors import InputError
from dav_gswt.terrain import finite, planet, stills
from dav_gswt.terrain.heights import QUARTER, FlatSurface, Sphere, make_sphere, require_plain_cover
from dav_gswt.terrain.planet import FACES, FaceCells, bend, frame_at, is_covered
from dav_gswt.terrain.stills import camera_on

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "sphere.json").read_text())
ORDERS = GOLDEN["orders"]
SIDE = 4.0
PINK = Sky(MAGENTA, MAGENTA)


def tangents_of(ball: Sphere, i, j):
    return ball.tangents(np.array(i + 0.5), np.array(j + 0.5))


def test_a_straight_walk_crosses_edges_and_corners_without_a_jump():
    begin = frame_at(10.0, 12.0)
    for way in ([0.0, 1.0], [0.8, 0.6], [-0.3, 0.95], [1.0, 1.0]):
        way = np.array(way) / np.hypot(*way)
        frames = [planet.walk_from(begin, way * step, 10.0) for step in range(63)]
        for frame, after in zip(frames, frames[1:], strict=False):
            np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
            assert np.abs(after - frame).max() < 0.101  # a tenth of a radian
        np.testing.assert_allclose(planet.walk_from(begin, way * 2 * np.pi * 10.0, 10.0), begin, atol=1e-12)


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
    cells = FaceCells(*(v.ravel() for v in np.mgrid[:6, -1 : ball.cells + 1, -1 : ball.cells + 1]))
    return cells[is_covered(ball, cells)]


@pytest.fixture(scope="module")
def tiles():
    return replace(two_level_terrain(), reach=48)


@pytest.mark.parametrize("view", ORDERS["views"], ids=lambda v: str(v["eye"]))
def test_cells_stand_in_the_order_shared_with_the_page(view):
    ball = Sphere(ORDERS["radius"], ORDERS["side"], ORDERS["cells"])
    cells = all_cells(ball)
    order, close = planet.sort_on_sphere(ball, cells, np.array(view["eye"], float))
    assert np.stack([cells.face, cells.i, cells.j], 1)[order].tolist() == view["order"]
    assert close[order].tolist() == view["close"]


def count_owners(ball: Sphere, points, salt: int):
    """How many faces' tilings show each place on the ground, over and beyond their edges."""
    owners = np.zeros(len(points), int)
    for face, (east, north, out) in enumerate(FACES):
        ahead = np.flatnonzero(points @ out > 0.1)
        tangents = points[ahead] @ np.stack([east, north], 1) / (points[ahead] @ out)[:, None]
        at = (np.arctan(tangents) / QUARTER + 0.5) * ball.cells
        cells = FaceCells(np.full(len(at), face), *np.floor(at).astype(np.int64).T)
        covered, frayed = is_covered(ball, cells), planet.is_frayed(ball, cells)
        places = np.concatenate([at, np.zeros((len(at), 1))], 1)
        stays = planet.find_kept(ball, face, places, salt)
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
        cell = FaceCells(*(np.array([one[name]]) for name in ("face", "i", "j")))
        assert planet.tiles_on(ball, cell, entry["salt"], entry["variants"]).tolist() == [one["tile"]]
    for one in entry["kept"]:
        places = np.array([one["place"]])
        assert planet.find_kept(ball, one["face"], places, entry["salt"])[0] == one["stays"]


def camera_over(terrain, point, height, pitch, yaw=20.0):
    up = np.array(point) / np.linalg.norm(point)
    axes = frame_at(*np.degrees([np.arctan2(up[1], up[0]), np.arcsin(up[2])]))
    return camera_on((terrain.heights.radius + height) * axes[2], axes, yaw, pitch, 64, 36)


def through(picture):
    """How much magenta shows: green is a half in tiles and 0 behind them."""
    return np.clip(1 - picture[..., 1] / 0.5, 0, 1)


@pytest.mark.parametrize(
    "radius, point, height, pitch",
    [
        pytest.param(8.0, (1, 1, 1), 6.0, -89.0, id="corner"),
        pytest.param(300.0, (1, 0.2, 1), 1.0, -60.0, id="turned edge"),
        pytest.param(8.0, (1, 1, 0.2), 1.0, -60.0, id="edge"),
        pytest.param(1e6, (0, 0, 1), 1.0, -60.0, id="pole"),
    ],
)
def test_the_ground_has_no_holes(tiles, radius, point, height, pitch):
    terrain = replace(tiles, heights=make_sphere(radius, SIDE))
    picture = stills.render_view(terrain, camera_over(terrain, point, height, pitch), PINK, MAGENTA)
    assert through(picture).max() < 0.1  # opaque discs' deviation is 0.7 of their spacing, stretched to 1.26


def test_a_sphere_has_one_material_no_objects_and_no_rectangles(tiles):
    ball = make_sphere(8.0, SIDE)
    with pytest.raises(InputError, match="plane"):
        finite.list_cells(replace(tiles, heights=ball), finite.Area(0, 0, 2, 2))
    require_plain_cover(FlatSurface(), {}, [1])
    require_plain_cover(ball, None, [])
    for cover, what in (((None, [1]), "objects"), (([1], None), "several materials")):
        with pytest.raises(InputError, match=f"{what}: give the scene `materials: one`"):
            require_plain_cover(ball, *cover)
