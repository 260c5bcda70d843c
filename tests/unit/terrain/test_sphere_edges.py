"""Edges of faces: colours that go on, edges that fray without gaps or overlaps, the values shared with the page."""

import json
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.terrain import sphere_edges
from dav_gswt.terrain.choice import tiles_at
from dav_gswt.terrain.sphere import EAST, FACES, NORTH, QUARTER, Sphere, make_sphere, step_cell

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "sphere.json").read_text())["spheres"]


def tile(ball, face, i, j, salt=7, variants=2):
    cell = [np.array([v]) for v in (face, i, j)]
    return int(sphere_edges.tiles_on(ball, cell[0], cell[1], cell[2], salt, variants)[0])


@pytest.mark.parametrize("salt", [0, 7, 2**32 - 1])
def test_colours_agree_across_every_edge_without_a_turn(salt):
    ball = make_sphere(6.0, 4.0)
    n, crossed = ball.cells, 0
    for face in range(6):
        for i, j in np.ndindex(n, n):
            for side, (here, there) in {EAST: (1, 3), NORTH: (2, 0)}.items():
                other = step_cell(ball, face, i, j, side)
                if other[3]:
                    continue
                crossed += other[0] != face
                assert tile(ball, face, i, j, salt) >> here & 1 == tile(ball, *other[:3], salt) >> there & 1
    assert crossed == 6 * n


def test_without_a_period_tiles_are_those_of_the_plane():
    i, j = np.meshgrid(np.arange(-20, 20), np.arange(-20, 20))
    assert (tiles_at(i, j, 3, 2, 10**9) == tiles_at(i, j, 3, 2))[:, :].sum() >= 800  # all but those below the first lap
    assert (tiles_at(i + 12, j + 12, 3, 2, 12) == tiles_at(i, j, 3, 2, 12)).all()


def count_owners(ball: Sphere, points, salt: int):
    """How many faces' tilings show each place on the ground, over and beyond their edges."""
    owners = np.zeros(len(points), int)
    for face, (east, north, out) in enumerate(FACES):
        ahead = np.flatnonzero(points @ out > 0.1)
        tangents = points[ahead] @ np.stack([east, north], 1) / (points[ahead] @ out)[:, None]
        at = (np.arctan(tangents) / QUARTER + 0.5) * ball.cells
        cells = [np.full(len(at), face), *np.floor(at).astype(np.int64).T]
        covered, frayed = sphere_edges.is_covered(ball, *cells), sphere_edges.is_frayed(ball, *cells)
        places = np.concatenate([at, np.zeros((len(at), 1))], 1)
        stays = sphere_edges.find_kept(ball, face, places, salt)
        owners[ahead] += covered & (~frayed | stays)
    return owners


@pytest.mark.parametrize("radius", [4.0, 40.0])
def test_each_place_belongs_to_one_face_also_at_edges_and_corners(radius):
    ball, rng = make_sphere(radius, 4.0), np.random.default_rng(5)
    anywhere = rng.normal(size=(20_000, 3))
    corners = rng.choice([-1, 1], (20_000, 3)) + 0.5 / radius * rng.normal(size=(20_000, 3))
    edges = rng.choice([-1, 1], (20_000, 3)) + 0.3 / radius * rng.normal(size=(20_000, 3))
    edges[np.arange(20_000), rng.integers(0, 3, 20_000)] = rng.uniform(-1, 1, 20_000)
    points = np.concatenate([anywhere, corners, edges])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for salt in (0, 7):
        assert (count_owners(ball, points, salt) == 1).all()


def test_turned_edges_are_moved_and_the_others_are_not():
    ball = make_sphere(40.0, 4.0)
    n = ball.cells
    along = np.linspace(1, n - 1, 400)
    beyond = np.stack([along, np.full(400, n + 0.1), np.zeros(400)], 1)  # to the north of an even face: turned
    stays = sphere_edges.find_kept(ball, 0, beyond, 7)
    assert 40 < stays.sum() < 360
    far = beyond + [0, sphere_edges.WIDTH + sphere_edges.HIGHEST, 0]
    assert not sphere_edges.find_kept(ball, 0, far, 7).any()
    east = np.stack([np.full(400, n - 0.01), along, np.zeros(400)], 1)  # tiles go on
    assert sphere_edges.find_kept(ball, 0, east, 7)[along < n - 1].all()


def test_what_rises_reaches_over_the_edge_from_both_sides():
    ball = make_sphere(40.0, 4.0)
    n = ball.cells
    at = np.stack([np.linspace(2, n - 2, 300), np.full(300, n + 0.15), np.zeros(300)], 1)
    low, high = (sphere_edges.find_kept(ball, 0, at + [0, 0, z], 7) for z in (0.0, 0.3))
    assert (high | ~low).all() and high.sum() > low.sum()


@pytest.mark.parametrize("entry", GOLDEN, ids=lambda e: str(e["cells"]))
def test_tiles_and_what_stays_are_those_shared_with_the_page(entry):
    ball = make_sphere(entry["radius"] / entry["side"], entry["side"])
    for one in entry["tiles"]:
        assert tile(ball, one["face"], one["i"], one["j"], entry["salt"], entry["variants"]) == one["tile"]
    for one in entry["kept"]:
        places = np.array([one["place"]])
        assert sphere_edges.find_kept(ball, one["face"], places, entry["salt"])[0] == one["stays"]
