"""The C++ core against hand-worked values, its float64 twin, and the invariances that any renderer must have."""

import numpy as np
import pytest
import torch
from scenes import NAMES, camera, cloud, one
from scipy.spatial.transform import Rotation

from dav_gswt import cameras
from dav_gswt.raster import _core, cpu
from dav_gswt.raster import torch as twin

ISAS = _core.instruction_sets()


@pytest.fixture(params=ISAS)
def isa(request, monkeypatch):
    monkeypatch.setenv("DAV_GSWT_ISA", request.param)
    return request.param


def test_one_gaussian_has_its_opacity_in_the_middle_and_falls_as_a_gaussian():
    view = cameras.top_down(west=-1.0, south=-1.0, width=21, height=21, cell=2 / 21, top=5.0)
    seen = cpu.Rasterizer(dilation=0.0).forward(*one(sigma=0.2), view)
    step = 2 / 21
    assert seen.alpha[10, 10] == pytest.approx(0.5, rel=1e-6)
    assert seen.alpha[10, 12] == pytest.approx(0.5 * np.exp(-0.5 * (2 * step / 0.2) ** 2), rel=1e-5)
    np.testing.assert_allclose(seen.colour[10, 10], [0.5, 0.25, 0.125], rtol=1e-6)
    assert seen.depth[10, 10] == pytest.approx(0.5 * 5, rel=1e-6)


def test_of_two_gaussians_the_nearer_one_covers_the_other():
    view = cameras.top_down(west=-1.0, south=-1.0, width=21, height=21, cell=2 / 21, top=5.0)
    far, near = one(colour=(1, 0, 0), opacity=0.6), one(mean=(0, 0, 1), colour=(0, 1, 0), opacity=0.5)
    seen = cpu.Rasterizer(dilation=0.0).forward(*(np.concatenate(v) for v in zip(far, near, strict=True)), view)
    np.testing.assert_allclose(seen.colour[10, 10], [0.5 * 0.6, 0.5, 0], rtol=1e-5)


@pytest.mark.parametrize("orthographic", [False, True], ids=["pinhole", "orthographic"])
def test_pictures_equal_the_float64_twins(isa, orthographic):
    values, view = cloud(), camera(orthographic=orthographic)
    seen, true = cpu.Rasterizer().forward(*values, view), twin.forward(*values, view)
    # float32 sums of up to 300 weights, and exp2's 3e-7; a splat may fall on the other side of the 1/255 cut
    for name in ("colour", "alpha", "depth"):
        np.testing.assert_allclose(getattr(seen, name), getattr(true, name), atol=2e-4)
        assert np.abs(getattr(seen, name) - getattr(true, name)).mean() < 2e-6


@pytest.mark.parametrize("orthographic", [False, True], ids=["pinhole", "orthographic"])
def test_gradients_equal_the_float64_twins(isa, orthographic):
    values, view = cloud(), camera(orthographic=orthographic)
    rng = np.random.default_rng(3)
    by = [rng.normal(size=s).astype(np.float32) for s in ((52, 70, 3), (52, 70), (52, 70))]
    raster = cpu.Rasterizer()
    raster.forward(*values, view)
    found = raster.backward(*by)
    leaves = [torch.tensor(v, dtype=torch.float64, requires_grad=True) for v in values]
    pictures = twin.differentiable(*leaves, view)
    sum((p * torch.tensor(g)).sum() for p, g in zip(pictures, by, strict=True)).backward()
    for name, leaf in zip(NAMES, leaves, strict=True):
        true, got = leaf.grad.numpy(), getattr(found, name)
        # relative to the whole array: float32 moments cancel in single entries
        assert np.linalg.norm(got - true) < 2e-4 * np.linalg.norm(true), name


def test_any_number_of_threads_gives_the_same_bits(isa, monkeypatch):
    values, view = cloud(2000), camera(200, 150)
    by = np.random.default_rng(0).normal(size=(150, 200, 3)).astype(np.float32)
    photo = np.random.default_rng(1).uniform(size=(150, 200, 3)).astype(np.float32)
    found = []
    for count in ("1", "2", "5"):
        monkeypatch.setenv("DAV_GSWT_THREADS", count)
        raster = cpu.Rasterizer()
        seen = raster.forward(*values, view)
        gradients = raster.backward(by)
        loss, slope = raster.loss(seen.colour, photo, np.ones((150, 200), np.float32), 0.2)
        found.append([seen.colour, seen.alpha, seen.depth, slope, np.array(loss), *vars(gradients).values()])
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(a, b)


def test_the_order_of_gaussians_does_not_matter():
    values, view = cloud(), camera()
    turned = np.random.default_rng(0).permutation(len(values[0]))
    a = cpu.Rasterizer().forward(*values, view)
    b = cpu.Rasterizer().forward(*(np.ascontiguousarray(v[turned]) for v in values), view)
    np.testing.assert_allclose(a.colour, b.colour, atol=1e-6)


def test_equal_depths_keep_the_order_of_the_list():
    view = cameras.top_down(west=-1.0, south=-1.0, width=21, height=21, cell=2 / 21, top=5.0)
    first, second = one(colour=(1, 0, 0)), one(colour=(0, 1, 0))
    seen = cpu.Rasterizer(dilation=0.0).forward(*(np.concatenate(v) for v in zip(first, second, strict=True)), view)
    np.testing.assert_allclose(seen.colour[10, 10], [0.5, 0.25, 0], rtol=1e-5)


def test_moving_scene_and_camera_together_changes_nothing():
    values, view = cloud(), camera()
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7])
    shift = np.array([1.0, -2, 0.5])
    moved = [v.copy() for v in values]
    moved[0] = (values[0] @ turn.as_matrix().T + shift).astype(np.float32)
    moved[2] = (turn * Rotation.from_quat(values[2], scalar_first=True)).as_quat(scalar_first=True).astype(np.float32)
    rotation = view.rotation @ turn.as_matrix().T
    other = cameras.Camera(**(vars(view) | {"rotation": rotation, "translation": view.translation - rotation @ shift}))
    a, b = cpu.Rasterizer().forward(*values, view), cpu.Rasterizer().forward(*moved, other)
    np.testing.assert_allclose(a.colour, b.colour, atol=1e-3)  # means are rounded to float32 anew
    assert np.abs(a.colour - b.colour).mean() < 1e-5


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scaling_scene_and_camera_together_changes_nothing(scale):
    values, view = cloud(), camera()
    scaled = [v.copy() for v in values]
    scaled[0], scaled[1] = values[0] * np.float32(scale), values[1] + np.float32(np.log(scale))
    other = cameras.Camera(**(vars(view) | {"translation": view.translation * scale}))
    a = cpu.Rasterizer().forward(*values, view)
    b = cpu.Rasterizer(near=0.01 * scale).forward(*scaled, other)
    np.testing.assert_allclose(a.colour, b.colour, atol=1e-3)
    np.testing.assert_allclose(a.depth * scale, b.depth, rtol=1e-3, atol=1e-3 * scale)


@pytest.mark.parametrize("factor", [-1.0, 7.0, 1e-6])
def test_a_quaternions_length_and_sign_do_not_matter(factor):
    values, view = cloud(), camera()
    scaled = [v.copy() for v in values]
    scaled[2] = values[2] * np.float32(factor)
    a, b = cpu.Rasterizer().forward(*values, view), cpu.Rasterizer().forward(*scaled, view)
    np.testing.assert_allclose(a.colour, b.colour, atol=1e-5)


def test_one_channel_is_drawn_as_three_are():
    values, view = cloud(), camera()
    grey = values[4][:, :1].copy()
    a = cpu.Rasterizer().forward(*values[:4], grey, view)
    b = cpu.Rasterizer().forward(*values, view)
    np.testing.assert_array_equal(a.colour[..., 0], b.colour[..., 0])


def test_a_map_of_ones_is_carried_back_as_the_sum_of_blend_weights():
    values, view = cloud(), camera()
    raster = cpu.Rasterizer()
    seen = raster.forward(*values, view)
    maps = np.zeros((52, 70, 3), np.float32)
    maps[..., 0] = 1
    weights = raster.carried(maps)
    assert weights[:, 0].sum() == pytest.approx(seen.alpha.sum(), rel=1e-4)
    assert not weights[:, 1:].any()
    np.testing.assert_allclose((weights[:, :1] * values[4]).sum(0), seen.colour.sum((0, 1)), rtol=1e-4)
