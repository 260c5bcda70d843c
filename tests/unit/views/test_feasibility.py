"""Poses that are buried, hidden or out of the limits, over a flat exemplar with a steep ridge to the east of it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import Pose
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views import feasibility

CELLS, SPACING = 192, 6 / 192
RIDGE = 147.5 * SPACING - 3  # 1.609, in the middle of a cell; the exemplar is the square from -1 to 1 in x and y


def ground(shift=(0.0, 0.0, 0.0), scale=1.0) -> Ground:
    """A ridge of height 1 along x = RIDGE: h = exp(-(x - RIDGE)^2 / (2 0.05^2))."""
    x = (np.arange(CELLS) + 0.5) * SPACING - 3
    heights = np.tile(np.exp(-((x - RIDGE) ** 2) / (2 * 0.05**2)), (CELLS, 1))
    west, south = scale * -3 + shift[0], scale * -3 + shift[1]
    return Ground(west, south, scale * SPACING, 64, 64, 64, scale * heights + shift[2], np.ones((CELLS, CELLS), bool))


def candidate(name, eye, target=(0, 0, 0), shift=(0.0, 0.0, 0.0), scale=1.0, fov=100.0):
    eye, target = (scale * np.array(v, float) + shift for v in (eye, target))
    away = eye - np.array(shift)
    return Pose(name, 0.0, 0.0, float(np.linalg.norm(away))), cameras.pinhole(eye, target, 64, 64, fov)


PLACES = {
    "above": (0, 0.01, 2.5),
    "aside": (-2, 0, 1.5),
    "over the ridge": (2.6, 0, 2),
    "behind the ridge": (2.6, 0, 1.5),
    "in its shadow": (2.6, 0, 0.4),
    "in the ridge": (RIDGE, 0, 0.5),
    "under the ground": (0, 0, -0.2),
    "near the ground": (-0.5, 0, 0.05),
    "near its slope": (RIDGE - 0.2, 0, 0.5),
}


def verdicts(grid=None, limits=None, **move):
    pool = [candidate(name, eye, **move) for name, eye in PLACES.items()]
    return feasibility.find_infeasible(
        pool, ground(**move) if grid is None else grid, limits, 0.15 * move.get("scale", 1.0)
    )


def kinds(reasons):
    return {name: reason.split(":")[0] for name, reason in reasons.items()}


def test_poses_in_the_ground_near_it_and_behind_the_ridge_are_rejected_and_no_others():
    assert kinds(verdicts()) == {
        "behind the ridge": "hidden",
        "in its shadow": "hidden",
        "in the ridge": "buried",
        "under the ground": "buried",
        "near the ground": "too near the ground",
        "near its slope": "too near the ground",
    }


@pytest.mark.parametrize("height, columns", [(1.5, 3), (1.7, 5), (2.0, 7)])
def test_what_is_in_sight_over_the_ridge_by_hand(height, columns):
    """From (2.6, 0, z) the ground at x shows where the line passes over the ridge: z (RIDGE - x) / (2.6 - x) >= 1,
    that is x <= (2.6 - RIDGE z) / (1 - z). The lattice's columns stand at (2 i - 8) / 9."""
    last = (2.6 - RIDGE * height) / (1 - height)
    assert np.sum((2 * np.arange(9) - 8) / 9 <= last) == columns
    site = feasibility._build_mesh(ground())
    camera = candidate("", (2.6, 0, height))[1]
    shown, seen = feasibility._count_visible(site, [camera], camera.centre[None])
    assert (shown[0], seen[0]) == (81, 9 * columns)


def test_the_distance_to_the_ground_is_not_the_height_over_it():
    """Beside a wall of 45 degrees that rises from x = 0: the distance is the height over the wall by the root of 2."""
    x = (np.arange(CELLS) + 0.5) * SPACING - 3
    wall = replace(ground(), heights=np.tile(np.maximum(x, 0), (CELLS, 1)))
    site = feasibility._build_mesh(wall)
    place = np.array([[1.0, 0.0, 1.3]])
    assert 2 * feasibility._measure_distance(site, site.local(place))[0] == pytest.approx(0.3 / 2**0.5, rel=1e-6)


@pytest.mark.parametrize("shift", [(1e6, -1e6, 0.0), (0.0, 0.0, 1e6)])
def test_the_world_may_lie_anywhere(shift):
    assert kinds(verdicts(shift=shift)) == kinds(verdicts())
    hidden = "behind the ridge"
    assert verdicts(shift=shift)[hidden] == verdicts()[hidden]  # the same points in sight


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_world_may_have_any_unit(scale):
    found = verdicts(scale=scale)
    assert kinds(found) == kinds(verdicts())
    assert (
        found["behind the ridge"]
        == verdicts()["behind the ridge"]
        == "hidden: 27 of 81 points of the exemplar are visible"
    )
    low = {"min_height": 2.1 * scale}
    assert kinds(verdicts(scale=scale, limits=low)) == kinds(verdicts(limits={"min_height": 2.1}))


@pytest.mark.parametrize(
    "limits, out",
    [
        ({"min_height": 2.2}, {"aside": "too low", "over the ridge": "too low"}),
        ({"max_height": 2.2}, {"above": "too high"}),
        ({"max_distance": 3.0}, {"over the ridge": "too far"}),
        ({"min_height": 0.1, "max_height": 9, "max_distance": 9}, {}),
    ],
)
def test_limits_bar_what_is_beyond_them(limits, out):
    found = kinds(verdicts(limits=limits))
    assert {name: found[name] for name in out} == out
    assert set(found) - set(out) == set(verdicts())


def test_pictures_that_miss_the_exemplar_or_all_ground_are_rejected():
    pool = [
        candidate("up", (0, 0, 2), (0, 1, 3)),
        candidate("away", (-2, 0, 1), (-3, 0, 0), fov=40.0),
        candidate("half", (0, 0, 2), (0, 3, 1.5), fov=140.0),
    ]
    found = feasibility.find_infeasible(pool, ground(), clearance=0.1)
    assert kinds(found) == {"up": "off the exemplar", "away": "off the exemplar", "half": "past the ground"}


def test_the_clearance_follows_from_the_flying_height_where_none_is_given():
    high = [candidate(f"{i}", (0, 0.01, 10)) for i in range(3)]
    low, lower = candidate("low", (0, 0.01, 0.52)), candidate("lower", (0, 0.01, 0.48))
    assert list(feasibility.find_infeasible([*high, low, lower], ground())) == ["lower"]


def test_without_embree_the_answers_are_the_same(monkeypatch, caplog):
    whole = verdicts()
    monkeypatch.setattr(trimesh.ray, "has_embree", False)
    assert verdicts() == whole
    assert "embreex is not installed" in caplog.text


def test_what_is_kept_and_how_many_are_not_is_said(caplog):
    pool = [candidate(name, eye) for name, eye in PLACES.items()]
    with caplog.at_level("INFO"):
        left = feasibility.filter_feasible(pool, ground(), clearance=0.15)
    assert [pose.name for pose, _ in left] == ["above", "aside", "over the ridge"]
    assert "6 of 9 candidate poses are left out: 2 hidden, 2 buried, 2 too near the ground" in caplog.text
    assert feasibility.filter_feasible([], ground()) == []
    with pytest.raises(InputError, match="any of the 1 candidate poses: 1 buried"):
        feasibility.filter_feasible([candidate("low", (0, 0, -1))], ground())
