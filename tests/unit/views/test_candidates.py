"""Candidate poses: free ones, on an orbit, along a route."""

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.views import candidates

FRAME = scene_frame(kind="photos", flying_height=5.0, exemplar=(10.0, 20.0, 4.0))
MIDDLE = np.array([12.0, 22.0, 0.0])
LENS = cameras.pinhole([0.0, 0.0, 5.0], [0.0, 1.0, 0.0], 60, 40, 50.0)


def stand(agent="handheld", count=120, **poses):
    poses = ({"aims": 1.0, "down": 35.0} | poses) if poses else {}
    scene = {"agent": agent, "candidates": count, "min_elevation": 30.0} | ({"poses": poses} if poses else {})
    return candidates.list_poses(scene, FRAME, LENS)


def aim(camera):
    """Where the middle of a picture meets the plane of the ground, and from how far."""
    away = camera.centre[2] / -camera.forward[2]
    return (camera.centre + away * camera.forward)[:2] - MIDDLE[:2], away


def test_an_orbit_looks_at_the_middle_from_the_flying_height():
    found = stand(kind="orbit")
    assert all(aim(camera)[1] == pytest.approx(5.0) for _, camera in found)
    assert max(np.abs(aim(camera)[0]).max() for _, camera in found) < 1e-9
    assert min(pose.elevation for pose, _ in found) >= 30 - 1e-9


def test_free_poses_spread_over_distances_aim_points_and_directions():
    aims, away = zip(*(aim(camera) for _, camera in stand("render", kind="free")), strict=True)
    assert 2 <= min(away) < 2.2 and 7.2 < max(away) <= 7.5
    counts = np.histogram2d(*np.array(aims).T, bins=3, range=[[-2, 2], [-2, 2]])[0]
    assert counts.min() >= 10 and counts.sum() == 120  # 13.3 in each of nine parts of the exemplar
    assert np.corrcoef(np.column_stack([aims, away, [c.forward[2] for _, c in stand("render", kind="free")]]).T)[
        0, 1:
    ] == pytest.approx(0, abs=0.1)


def test_radii_and_aims_of_free_poses_are_those_asked_for():
    found = stand(kind="free", radii=[2.0, 3.0], aims=0.0)
    assert all(10 <= aim(camera)[1] <= 15 and np.abs(aim(camera)[0]).max() < 1e-9 for _, camera in found)


@pytest.mark.parametrize("agent", ["handheld", "plan"])
def test_nobody_is_sent_higher_than_the_first_photos_were_taken(agent):
    found = stand(agent, kind="free")
    assert max(camera.centre[2] for _, camera in found) <= 5.0
    assert min(aim(camera)[1] for _, camera in found) >= 2 and max(aim(camera)[1] for _, camera in found) <= 5.0


@pytest.mark.parametrize("agent", ["render", "serial", "plan", "handheld"])
def test_photos_are_taken_on_an_orbit_unless_told_otherwise(agent):
    assert {round(aim(camera)[1], 6) for _, camera in stand(agent)} == {5.0}


def test_a_route_has_stops_along_it_with_headings_to_all_sides():
    found = stand(kind="route", places=[[-0.5, 0.0], [0.5, 0.0], [0.5, 0.5]], height=0.2, down=30.0, count=60)
    at = np.array([camera.centre - MIDDLE for _, camera in found])[::4]
    assert at[0] == pytest.approx([-2, 0, 1]) and at[-1] == pytest.approx([2, 2, 1])
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    assert np.median(steps) == pytest.approx(6 / 14, rel=1e-6)
    assert all(camera.forward[2] == pytest.approx(-0.5) for _, camera in found)
    headings = np.degrees([np.arctan2(camera.forward[1], camera.forward[0]) for _, camera in found[:4]]) % 360
    assert headings == pytest.approx([0, 90, 180, 270], abs=1e-6)


def test_photos_are_asked_for_with_the_lens_of_most_pictures(tmp_path):
    turned = cameras.pinhole([0.0, 0.0, 5.0], [0.0, 1.0, 0.0], 40, 60, 50.0)
    none = np.zeros(0, int)
    points = np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))
    write_colmap_model(ColmapModel(("a.png", "b.png", "c.png"), (turned, LENS, LENS), *points), tmp_path)
    scene = {"agent": "handheld", "candidates": 4, "min_elevation": 30.0}
    found = candidates.list_remaining(scene, FRAME, tmp_path, ViewSplit(("a.png",), (), ()), [])
    assert {(camera.width, camera.height) for _, camera in found} == {(60, 40)}


def test_a_route_without_length_is_refused():
    with pytest.raises(InputError, match=r"poses\.places: a route needs two places"):
        stand(kind="route", places=[[0.1, 0.1], [0.1, 0.1]], height=0.2)


@pytest.mark.parametrize("kind", ["orbit", "free", "route"])
def test_every_candidate_has_the_lens_it_is_given_and_a_name_of_its_own(kind):
    found = stand(kind=kind, places=[[0, 0], [1, 0]], height=0.3, count=8)
    assert len({pose.name for pose, _ in found}) == 8
    assert all((c.fx, c.cx, c.width, c.height) == (LENS.fx, LENS.cx, 60, 40) for _, c in found)
    assert stand(kind=kind, places=[[0, 0], [1, 0]], height=0.3, count=0) == []
