import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts, cameras
from dav_gswt.geometry.poses import Pose
from dav_gswt.study.views import sphere
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty import Scales

FRAME = scene_frame(exemplar=(1.0, 2.0, 2.0))
MIDDLE = np.array([2.0, 3.0, 0.0])


def round_of(number=1, chosen=(5, 40, 2), photos=((0.0, 0.0, 5.0), (0.0, -3.0, 3.0)), high=1.0, count=60):
    poses = [Pose(f"p{i}", *place) for i, place in enumerate(camera_layouts.hemisphere(count, 30.0, 5.0))]
    terms = {"coverage": np.linspace(0.0, high, count)}
    scored = Scores(poses, terms, Scales({"coverage": 0.5}), np.zeros(count, int))
    taken = [cameras.pinhole(MIDDLE + eye, MIDDLE, 8, 8, 40.0) for eye in photos]
    return sphere.build_round(number, scored, [Pose(f"p{i}", 45.0, 0.0, 5.0) for i in chosen], taken, FRAME, 0.0)


def test_a_round_holds_the_photos_before_it_and_its_choice_where_they_are_seen_from_above():
    poses = [Pose("", 90.0, 200.0, 5.0), Pose("", 0.0, 0.0, 5.0), Pose("", 30.0, 90.0, 9.0)]
    expected = [[np.radians(200), 0], [0, 1], [np.pi / 2, 0.5**0.5]]
    np.testing.assert_allclose(sphere.project_poses(poses), expected, atol=1e-7)
    one = round_of()
    assert one.chosen == [5, 40, 2] and one.candidates.shape == (60, 2)
    np.testing.assert_allclose(one.taken[0, 1], 0, atol=1e-7)
    np.testing.assert_allclose(one.taken[1] % (2 * np.pi), [1.5 * np.pi, np.sqrt(1 - np.sin(np.pi / 4))])
    assert 30 < one.lowest < 31  # of the candidates: the photos stand higher
    assert round_of(photos=((4.0, 0.0, 1.0),)).lowest == pytest.approx(np.degrees(np.arctan2(1, 4)))
    with pytest.raises(InputError, match="poses.json of round 3: p77 is not among"):
        round_of(3, chosen=(1, 77))
