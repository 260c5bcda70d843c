"""Candidate poses: on an orbit, along a route; and those that are buried, hidden or in an object.

These are judged over a flat exemplar with a steep ridge to the east of it.
"""

from functools import cache

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import Pose
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.objects import make_blobs
from dav_gswt.views import candidates

FRAME = scene_frame(kind="photos", flying_height=5.0, exemplar=(10.0, 20.0, 4.0))
MIDDLE = np.array([12.0, 22.0, 0.0])
LENS = cameras.pinhole([0.0, 0.0, 5.0], [0.0, 1.0, 0.0], 60, 40, 50.0)


def stand(poses, agent="handheld", count=120):
    return candidates.list_poses({"agent": agent, "candidates": count, "poses": poses}, FRAME, LENS)


def aim(camera):
    """Where the middle of a picture meets the plane of the ground, and from how far."""
    away = camera.centre[2] / -camera.forward[2]
    return (camera.centre + away * camera.forward)[:2] - MIDDLE[:2], away


def test_an_orbit_looks_at_the_middle_from_the_flying_height():
    found = stand("orbit", count=20)
    assert all(aim(camera)[1] == pytest.approx(5.0) for _, camera in found)
    assert max(np.abs(aim(camera)[0]).max() for _, camera in found) < 1e-9
    assert min(pose.elevation for pose, _ in found) >= 30 - 1e-9


def test_nobody_is_sent_higher_than_the_first_photos_were_taken():
    found = [aim(camera)[1] for _, camera in stand("free")]
    assert min(found) >= 2 and max(found) <= 5.0


def test_a_route_has_stops_along_it_with_headings_to_all_sides():
    found = stand({"places": [[-0.5, 0.0], [0.5, 0.0], [0.5, 0.5]], "height": 0.2, "down": 30.0}, count=60)
    at = np.array([camera.centre - MIDDLE for _, camera in found])[::4]
    assert at[0] == pytest.approx([-2, 0, 1]) and at[-1] == pytest.approx([2, 2, 1])
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    assert np.median(steps) == pytest.approx(6 / 14, rel=1e-6)
    assert all(camera.forward[2] == pytest.approx(-0.5) for _, camera in found)
    headings = np.degrees([np.arctan2(camera.forward[1], camera.forward[0]) for _, camera in found[:4]]) % 360
    assert headings == pytest.approx([0, 90, 180, 270], abs=1e-6)
    with pytest.raises(InputError, match=r"poses\.places: a route needs two places"):
        stand({"places": [[0.1, 0.1], [0.1, 0.1]], "height": 0.2, "down": 35.0})


def test_photos_are_asked_for_with_the_lens_of_most_pictures(tmp_path):
    turned = cameras.pinhole([0.0, 0.0, 5.0], [0.0, 1.0, 0.0], 40, 60, 50.0)
    none = np.zeros(0, int)
    points = np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))
    write_colmap_model(ColmapModel(("a.png", "b.png", "c.png"), (turned, LENS, LENS), *points), tmp_path)
    scene = {"agent": "handheld", "candidates": 4, "poses": "orbit"}
    found = candidates.list_remaining(scene, FRAME, tmp_path, ViewSplit(("a.png",), (), ()), [])
    assert {(camera.width, camera.height) for _, camera in found} == {(60, 40)}


CELLS, SPACING = 192, 6 / 192
RIDGE = 147.5 * SPACING - 3  # 1.609, in the middle of a cell; the exemplar is the square from -1 to 1 in x and y


@cache
def ground(shift=(0.0, 0.0, 0.0), scale=1.0) -> Ground:
    """A ridge of height 1 along x = RIDGE: h = exp(-(x - RIDGE)^2 / (2 0.05^2))."""
    x = (np.arange(CELLS) + 0.5) * SPACING - 3
    heights = np.tile(np.exp(-((x - RIDGE) ** 2) / (2 * 0.05**2)), (CELLS, 1))
    west, south = scale * -3 + shift[0], scale * -3 + shift[1]
    return Ground(west, south, scale * SPACING, 64, 64, 64, scale * heights + shift[2], np.ones((CELLS, CELLS), bool))


def candidate(name, eye, target=(0, 0, 0), shift=(0.0, 0.0, 0.0), scale=1.0, fov=100.0):
    away = scale * float(np.linalg.norm(eye))
    eye, target = (scale * np.array(v, float) + shift for v in (eye, target))
    return Pose(name, 0.0, 0.0, away), cameras.pinhole(eye, target, 64, 64, fov)


PLACES = {
    "above": (0, 0.01, 2.5),
    "aside": (-2, 0, 1.5),
    "over the ridge": (2.6, 0, 2),
    "behind the ridge": (2.6, 0, 1.5),
    "in its shadow": (2.6, 0, 0.4),
    "in the ridge": (RIDGE, 0, 0.5),
    "under the ground": (0, 0, -0.2),
    "near the ground": (-0.5, 0, 0.05),
    "near its slope": (RIDGE - 0.1, 0, 0.2),
    "in a tree": (-0.5, 0, 1.5),
}
BLOCK = make_blobs(np.array([[-0.5, 0.0, 1.5]]), np.full((1, 3), 0.5), np.full(1, 0.1), logit=4.0)


def verdicts(**move):
    pool = [candidate(name, eye, **move) for name, eye in PLACES.items()]
    block = BLOCK[:0] if move else BLOCK  # single precision knows no places far out
    return candidates.find_infeasible(pool, block, ground(**move), 0.15 * move.get("scale", 1.0))


@pytest.fixture(scope="module")
def usual():
    return verdicts()


def test_poses_in_the_ground_near_it_and_behind_the_ridge_are_rejected_and_no_others(usual):
    assert usual == {
        "behind the ridge": "hidden",
        "in its shadow": "hidden",
        "in the ridge": "buried",
        "under the ground": "buried",
        "near the ground": "too near the ground",
        "near its slope": "too near the ground",
        "in a tree": "inside an object",
    }


@pytest.mark.parametrize("move", [{"shift": (1e6, -1e6, 1e6)}, {"scale": 1e-3}], ids=str)
def test_the_world_may_lie_anywhere_and_have_any_unit(usual, move):
    assert verdicts(**move) | {"in a tree": "inside an object"} == usual


def test_pictures_that_miss_the_exemplar_or_all_ground_are_rejected():
    away, half = (-2, 0, 1), (0, 0, 2)
    pool = [candidate("away", away, (-3, 0, 0), fov=40.0), candidate("half", half, (0, 3, 1.5), fov=140.0)]
    found = candidates.find_infeasible(pool, BLOCK, ground(), 0.1)
    assert found == {"away": "off the exemplar", "half": "past the ground"}


def test_what_is_kept_and_how_many_are_not_is_said(caplog):
    with caplog.at_level("INFO"):
        left = candidates.filter_feasible([candidate(*place) for place in PLACES.items()], BLOCK, ground(), 3.0)
    assert [pose.name for pose, _ in left] == ["above", "aside", "over the ridge"]
    assert "7 of 10 candidate poses are left out: 2 hidden, 2 buried, 2 too near the ground, 1 inside an" in caplog.text
    assert candidates.filter_feasible([], BLOCK, ground(), 3.0) == []
    with pytest.raises(InputError, match=r"any of the 1 candidate poses \(1 buried\)"):
        candidates.filter_feasible([candidate("low", (0, 0, -1))], BLOCK, ground(), 3.0)
