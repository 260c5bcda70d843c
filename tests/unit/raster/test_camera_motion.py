"""The gradient by a small motion of the camera, against cameras that are really moved."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from fixtures.backend_scenes import SCENES
from fixtures.raster_scenes import relative
from scipy.spatial.transform import Rotation

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import cpu, oracle

STEP = 2e-9  # so small that hardly a pixel crosses a splat's rim, where alpha jumps by 1/255; float64 has digits left
VIEWS = ["a cloud", "a cloud on a map", "harmonics of degree 3", "harmonics on a map", "antialiased", "features"]


def moved(camera: Camera, motion: np.ndarray) -> Camera:
    """q' = exp([w]x) q + tau in the camera's frame."""
    turn = Rotation.from_rotvec(motion[:3]).as_matrix()
    return replace(camera, rotation=turn @ camera.rotation, translation=turn @ camera.translation + motion[3:])


def weights_of(pictures) -> list[np.ndarray]:
    return [np.random.default_rng(5).normal(size=p.shape) for p in pictures]


def differences(name: str) -> tuple[np.ndarray, list[np.ndarray]]:
    """Of the scalar product of the oracle's pictures with some weights, by each of the six motions; those weights."""
    scene = SCENES[name]
    leaves = {k: torch.tensor(v, dtype=torch.float64) for k, v in scene.arrays.items()}

    def value(motion):
        pictures = oracle.forward(**leaves, camera=moved(scene.camera, motion), **scene.options)
        return sum((p.numpy() * w).sum() for p, w in zip(pictures, weights, strict=True))

    weights = weights_of(oracle.forward(**leaves, camera=scene.camera, **scene.options))
    steps = STEP * np.eye(6)
    return np.array([(value(step) - value(-step)) / (2 * STEP) for step in steps]), weights


@pytest.mark.parametrize("name", VIEWS)
def test_the_gradient_is_what_a_moved_camera_shows(isa, name):
    scene = SCENES[name]
    wanted, weights = differences(name)
    raster = cpu.Rasterizer(**scene.options, instruction_set=isa)
    raster.forward(**scene.arrays, camera=scene.camera)
    found = raster.backward(*(np.ascontiguousarray(w, np.float32) for w in weights))
    assert relative(found.camera, wanted) < 5e-5, (found.camera, wanted)  # float32 sums of 1e5 terms of both signs


def test_moving_the_camera_is_moving_the_scene_the_other_way(isa):
    """Without rotation, tau in the camera's frame shifts all means by R^T tau: the gradients say so too."""
    scene = SCENES["harmonics of degree 2"]
    raster = cpu.Rasterizer(instruction_set=isa)
    seen = raster.forward(**scene.arrays, camera=scene.camera)
    found = raster.backward(np.ascontiguousarray(weights_of([seen.colour])[0], np.float32))
    np.testing.assert_allclose(
        found.camera[3:],
        scene.camera.rotation @ found.means.sum(0, dtype=float),
        rtol=1e-4,
        atol=1e-5 * np.abs(found.means).sum(),
    )
