"""Autograd through the rasterizer, against autograd through the oracle."""

import numpy as np
import pytest
import torch
from fixtures.backend_scenes import SCENES
from fixtures.raster_scenes import NAMES, relative

from dav_gswt.raster import backends, oracle
from dav_gswt.raster.autograd import rasterize

THERE = [name for name in backends.NAMES if not backends.explain_unavailable(name)]


def leaves_of(name: str, kind: torch.dtype) -> dict[str, torch.Tensor]:
    arrays = SCENES[name].arrays | {"motion": np.zeros(6)}
    return {k: torch.tensor(a, dtype=kind, requires_grad=True) for k, a in arrays.items()}


def objective(images) -> torch.Tensor:
    """Something that is not linear in any picture."""
    return sum((image**2).mean() + torch.sin(3 * image).mean() for image in images)


@pytest.mark.parametrize("backend", THERE)
@pytest.mark.parametrize("name", ["features", "harmonics of degree 2"])
def test_gradients_of_an_objective_are_the_oracles(backend, name):
    """Of tensors in float64, which pictures keep though they are drawn in float32."""
    camera, leaves, twins = SCENES[name].camera, leaves_of(name, torch.float64), leaves_of(name, torch.float64)
    images = rasterize(**leaves, camera=camera, backend=backend)
    assert all(image.dtype == torch.float64 for image in images)
    found, wanted = objective(images), objective(oracle.forward(**twins, camera=camera))
    found.backward()
    wanted.backward()
    assert found.item() == pytest.approx(wanted.item(), rel=1e-5)
    for parameter, twin in twins.items():
        # float32 pictures of some hundred roundings, squared and summed
        assert relative(leaves[parameter].grad.numpy(), twin.grad.numpy()) < 1e-4, parameter


def test_two_pictures_before_one_backward_do_not_mix():
    camera, leaves = SCENES["a cloud"].camera, leaves_of("a cloud", torch.float32)
    motion = leaves.pop("motion")
    together = sum(objective(rasterize(**leaves, camera=camera, motion=motion, dilation=d)) for d in (0.3, 1.0))
    together.backward()
    both = {name: leaf.grad.clone() for name, leaf in leaves.items()}
    for leaf in leaves.values():
        leaf.grad = None
    for dilation in (0.3, 1.0):
        objective(rasterize(**leaves, camera=camera, dilation=dilation)).backward()
    for name in NAMES:
        np.testing.assert_allclose(leaves[name].grad, both[name], rtol=1e-5, atol=1e-7)


def test_a_motion_that_is_not_zero_is_refused():
    leaves = leaves_of("a cloud", torch.float32) | {"motion": torch.ones(6)}
    with pytest.raises(ValueError, match="move the camera itself"):
        rasterize(**leaves, camera=SCENES["a cloud"].camera)
