from dataclasses import replace

import numpy as np
from fixtures import ground as made
from scipy.spatial.transform import Rotation

from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitPlan
from dav_gswt.reconstruction.fitting.pose_refinement import PoseCorrections
from dav_gswt.reconstruction.ground_constraints import GroundConstraints


def test_a_camera_without_correction_is_the_same_object():
    camera = made.photos(1)[0].camera
    assert PoseCorrections(1).correct(0, camera) is camera


def test_corrections_compose_as_motions_of_the_camera():
    camera = made.photos(1)[0].camera
    poses = PoseCorrections(1)
    poses.descend(0, np.array([1.0, 0, 0, 0, 0, 0]), 0.01, camera)
    moved = poses.correct(0, camera)
    turn = Rotation.from_matrix(moved.rotation @ camera.rotation.T).as_rotvec()
    np.testing.assert_allclose(turn, [-0.01, 0, 0], atol=1e-9)  # Adam's first step is the rate, against the gradient


def test_a_camera_that_is_off_finds_its_place():
    photos = made.photos(3)
    camera = photos[2].camera
    off = replace(camera, translation=camera.translation + np.array([0.04, 0.0, 0.0]))
    grid = made.grid()
    seen = []
    original = PoseCorrections.descend

    def spy(self, index, gradient, rate, camera):
        original(self, index, gradient, rate, camera)
        seen.append(self.twists.copy())

    PoseCorrections.descend = spy
    try:
        constraints = GroundConstraints(grid, np.full(grid.shape, 0.5))
        constraints.detail = 1e-9  # the ground stays where it is
        views = [*photos[:2], replace(photos[2], camera=off)]
        trainer.fit_field(made.field(), views, FitPlan(600, 1, pose_rate=3e-4), constraints, np.random.default_rng(0))
    finally:
        PoseCorrections.descend = original
    # a turn and a shift look alike on flat ground: judged by where the ground's middle is seen
    moved = replace(
        off,
        rotation=Rotation.from_rotvec(seen[-1][2, :3]).as_matrix() @ off.rotation,
        translation=Rotation.from_rotvec(seen[-1][2, :3]).apply(off.translation) + seen[-1][2, 3:],
    )
    at = np.array([[1.6, 1.6, 0.0]])
    gone = np.linalg.norm(moved.project(at)[0] - camera.project(at)[0])
    before = np.linalg.norm(off.project(at)[0] - camera.project(at)[0])
    assert gone < 0.5 * before  # the rest is shared by the two others and the discs
