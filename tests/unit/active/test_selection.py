import numpy as np
import pytest

from dav_gswt.active import poses, selection
from dav_gswt.active.poses import Pose, Scored
from dav_gswt.errors import InputError

RNG = np.random.default_rng


def scored(*places, opacity=None):
    """Candidates at azimuths (degrees) on the horizon of a unit circle."""
    return [
        Scored(Pose(f"p{i}", 0.0, float(a), 1.0), float(o))
        for i, (a, o) in enumerate(zip(places, opacity or [0.0] * len(places), strict=True))
    ]


def test_farthest_takes_the_opposite_side_then_the_gaps():
    pool = scored(0, 90, 180, 270, 10)
    captured = np.array([[1.0, 0, 0]])
    names = [p.name for p in selection.select("farthest", pool, captured, 3, RNG(0))]
    assert names[0] == "p2"  # 180 is farthest from 0; then come 90 and 270, equal but for rounding
    assert set(names[1:]) == {"p1", "p3"}


def test_equal_distances_go_by_index():
    assert [p.name for p in selection.select("farthest", scored(90, 90), np.array([[1.0, 0, 0]]), 1, RNG(0))] == ["p0"]


def test_farthest_does_not_take_a_pose_twice_when_all_coincide():
    pool = scored(0, 0, 0)
    names = [p.name for p in selection.select("farthest", pool, np.zeros((0, 3)), 3, RNG(0))]
    assert sorted(names) == ["p0", "p1", "p2"]


def test_opacity_takes_the_most_unknown_and_ties_by_index():
    pool = scored(0, 1, 2, 3, opacity=[0.1, 0.5, 0.5, 0.2])
    assert [p.name for p in selection.select("opacity", pool, np.zeros((0, 3)), 3, RNG(0))] == ["p1", "p2", "p3"]


def test_random_depends_on_its_generator_alone():
    pool = scored(*range(20))
    draw = [[p.name for p in selection.select("random", pool, np.zeros((0, 3)), 5, RNG(s))] for s in (1, 1, 2)]
    assert draw[0] == draw[1] != draw[2]
    assert len(set(draw[0])) == 5


@pytest.mark.parametrize("policy", ["farthest", "opacity", "random"])
def test_a_pool_that_is_too_small_is_taken_whole_and_said_so(policy, caplog):
    pool = scored(0, 90)
    assert len(selection.select(policy, pool, np.array([[1.0, 0, 0]]), 5, RNG(0))) == 2
    assert "only 2 candidates" in caplog.text
    assert selection.select(policy, [], np.zeros((0, 3)), 5, RNG(0)) == []
    assert "no candidate pose is left" in caplog.text


def test_scores_come_back_to_the_bit(tmp_path):
    pool = scored(0.1, 33.3333333333, opacity=[1 / 3, 0.25])
    poses.write_scores(tmp_path / "s.csv", pool)
    assert poses.read_scores(tmp_path / "s.csv") == pool


def test_scores_that_are_not_finite_name_their_poses(tmp_path):
    poses.write_scores(tmp_path / "s.csv", scored(0, 1, opacity=[float("nan"), 0]))
    with pytest.raises(InputError, match="p0"):
        poses.read_scores(tmp_path / "s.csv")


def test_a_pose_is_where_its_camera_is():
    from dav_gswt import cameras

    frame = {"exemplar": {"west": 1.0, "south": 2.0, "side": 2.0}}
    camera = cameras.pinhole([2.0, 3 + 3.0, 4.0], [2, 3, 0], 10, 10, 40.0)
    pose = poses.of_camera("x", camera, frame)
    assert (pose.azimuth, pose.radius) == (pytest.approx(90), pytest.approx(5))
    np.testing.assert_allclose(poses.place(pose), [0, 3, 4], atol=1e-12)
