"""Which candidates remain, by agent: over flat ground, a pose above it and one below it."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch
from fixtures.frames import scene_frame

from dav_gswt.capture.capturing import filter_attainable
from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.poses import Pose
from dav_gswt.reconstruction.ground import Ground

FRAME = scene_frame(exemplar=(-1.0, -1.0, 2.0), flying_height=2.0)
GRID = Ground(-3.0, -3.0, 6 / 48, 16, 16, 16, np.zeros((48, 48)), np.ones((48, 48), bool))
EMPTY = patch.field()[:0]
POOL = [
    (Pose("above", 90.0, 0.0, 2.5), cameras.pinhole([0, 0.01, 2.5], [0, 0, 0], 64, 64, 100.0)),
    (Pose("below", -90.0, 0.0, 0.2), cameras.pinhole([0, 0.01, -0.2], [0, 0, 0], 64, 64, 100.0)),
]


def names(scene):
    return [pose.name for pose, _ in filter_attainable(scene, FRAME, GRID, EMPTY, POOL)]


def test_infeasible_poses_are_left_out_but_of_a_replayed_scene():
    assert names({"agent": "replay"}) == ["above", "below"]
    assert names({"agent": "handheld"}) == ["above"]
    # the clearance is a share of the flying height
    near = [*POOL, (Pose("near", 90.0, 0.0, 0.09), cameras.pinhole([0.5, 0.01, 0.09], [0, 0, 0], 64, 64, 100.0))]
    found = filter_attainable({"agent": "render"}, FRAME, GRID, EMPTY, near)
    assert [pose.name for pose, _ in found] == ["above"]


def test_a_drone_is_sent_no_lower_than_it_may_fly():
    place = replace(FRAME, georeference=Georeference(48.0, 11.0, 500.0, 0.0, metres_per_unit=4.0))
    low = (Pose("low", 90.0, 0.0, 0.4), cameras.pinhole([0, 0.01, 0.4], [0, 0, 0], 64, 64, 100.0))

    def kept(frame, altitude):
        scene = {"agent": "plan", "drone": {"min_altitude": altitude}}
        return [pose.name for pose, _ in filter_attainable(scene, frame, GRID, EMPTY, [*POOL, low])]

    assert kept(FRAME, 2.0) == ["above", "low"] == kept(place, 1.5)
    assert kept(place, 2.0) == ["above"]
    with pytest.raises(InputError, match="all 3 candidate poses are lower than 12 m"):
        kept(place, 12.0)
