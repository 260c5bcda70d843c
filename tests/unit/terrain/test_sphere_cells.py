"""Cells in view on a sphere: none is lost, none is drawn before one that hides it, the shared lists."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.terrains import two_level_terrain
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.terrain import sphere_cells
from dav_gswt.terrain.ground_mapping import camera_on
from dav_gswt.terrain.sphere import Sphere, directions, frame_at, locate, make_sphere
from dav_gswt.terrain.sphere_edges import is_covered

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "sphere.json").read_text())["orders"]


def all_cells(ball: Sphere):
    face, i, j = (v.ravel() for v in np.mgrid[:6, -1 : ball.cells + 1, -1 : ball.cells + 1])
    covered = is_covered(ball, face, i, j)
    return face[covered], i[covered], j[covered]


@pytest.fixture(scope="module")
def planet():
    return replace(two_level_terrain(), heights=make_sphere(8.0, 4.0), reach=48)


@pytest.mark.parametrize("view", GOLDEN["views"], ids=lambda v: str(v["eye"]))
def test_cells_stand_in_the_order_shared_with_the_page(view):
    ball = Sphere(GOLDEN["radius"], GOLDEN["side"], GOLDEN["cells"])
    face, i, j = all_cells(ball)
    order, close = sphere_cells.sort_on_sphere(ball, face, i, j, np.array(view["eye"], float))
    assert np.stack([face, i, j], 1)[order].tolist() == view["order"]
    assert close[order].tolist() == view["close"]


@given(st.floats(-180, 180), st.floats(-90, 90), st.floats(0.01, 3), st.floats(-180, 180), st.floats(0, 1))
def test_no_ray_meets_a_cell_before_one_that_is_drawn_after_it(longitude, latitude, height, yaw, down):
    """The slow way: walk along a ray through the shell of tiles and note the cells in the order that it enters them."""
    ball, axes = make_sphere(6.0, 1.0), frame_at(longitude, latitude)
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
    faces, places = locate(ball, points)
    met = np.concatenate([faces[:, None], np.floor(places).astype(int)], 1)
    entered = [(int(f), int(a), int(b)) for f, a, b in met[np.r_[True, (np.diff(met, axis=0) != 0).any(1)]]]
    drawn = [place[cell] for cell in entered if cell not in near]  # those are sorted by depth
    assert drawn == sorted(drawn, reverse=True)


@pytest.mark.parametrize("height", [0.3, 3.0, 60.0])
@pytest.mark.parametrize("point", [(1, 1, 1), (1, 0, 0), (-1, -1, 0), (0.3, -0.9, 1)])
def test_no_cell_of_which_something_shows_is_lost(planet, point, height):
    ball, up = planet.heights, np.array(point) / np.linalg.norm(point)
    longitude, latitude = np.degrees([np.arctan2(up[1], up[0]), np.arcsin(up[2])])
    axes = frame_at(longitude, latitude)
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


def test_a_large_planet_is_as_quick_as_a_small_one(planet):
    ball, axes = make_sphere(1e7, 4.0), frame_at(20.0, 30.0)
    camera = camera_on((ball.radius + 1.0) * axes[2], axes, 60.0, -12.0, 64, 36)
    cells = sphere_cells.visible_on_sphere(replace(planet, heights=ball, reach=12), ball, camera)
    assert 20 < len(cells) < 700
    assert cells.close.sum() <= 9 and cells.nearest.min() < 4
