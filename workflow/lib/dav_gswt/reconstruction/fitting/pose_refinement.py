"""Corrections of the cameras, optimised with the field: q' = exp([w]x) q + tau for each photo."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.geometry.cameras import Camera

BETAS = 0.9, 0.999


class PoseCorrections:
    """The corrections (w, tau), Adam's moments, and the number of steps of each photo."""

    def __init__(self, views: int):
        self.twists, self.first, self.second = (np.zeros((views, 6)) for _ in range(3))
        self.turns = np.zeros(views, int)

    def correct(self, index: int, camera: Camera) -> Camera:
        """The camera with its correction; the same object while that is 0."""
        if not self.twists[index].any():
            return camera
        turn = Rotation.from_rotvec(self.twists[index, :3]).as_matrix()
        return _with_pose(camera, turn @ camera.rotation, turn @ camera.translation + self.twists[index, 3:])

    def descend(self, index: int, gradient: Float[Array, "6"], rate: float, camera: Camera) -> None:
        """One step of Adam. rate: radians a step; times the camera's height over the ground for the position."""
        self.turns[index] += 1
        g, t = np.asarray(gradient, float), self.turns[index]
        self.first[index] = BETAS[0] * self.first[index] + (1 - BETAS[0]) * g
        self.second[index] = BETAS[1] * self.second[index] + (1 - BETAS[1]) * g * g
        m, v = self.first[index] / (1 - BETAS[0] ** t), self.second[index] / (1 - BETAS[1] ** t)
        unit = np.repeat([1.0, max(abs(float(camera.centre[2])), 1e-6)], 3)
        step = rate * unit * m / (np.sqrt(v) + 1e-15)
        # compose with the correction so far, as one twist
        turn = Rotation.from_rotvec(-step[:3])
        self.twists[index, 3:] = turn.apply(self.twists[index, 3:]) - step[3:]
        self.twists[index, :3] = (turn * Rotation.from_rotvec(self.twists[index, :3])).as_rotvec()


def _with_pose(camera: Camera, rotation: Float[Array, "3 3"], translation: Float[Array, "3"]) -> Camera:
    return replace(camera, rotation=rotation, translation=translation)
