"""L1 + D-SSIM against a plain float64 twin with autograd's gradient."""

import numpy as np
import pytest
import torch

from dav_gswt.raster import cpu


@pytest.fixture(autouse=True)
def in_every_instruction_set(isa, monkeypatch):
    monkeypatch.setenv("DAV_GSWT_ISA", isa)


def twin(x, y, w, structure):
    """The loss by its docstring: windows by dense convolution, sums over the pixels that count."""
    taps = torch.exp(-((torch.arange(11, dtype=torch.float64) - 5) ** 2) / (2 * 1.5**2))
    window = torch.outer(taps, taps) / taps.sum() ** 2

    def local(f):  # h w c -> the same, summed over each window
        planes = f.permute(2, 0, 1)[:, None]
        return torch.nn.functional.conv2d(planes, window[None, None], padding=5)[:, 0].permute(1, 2, 0)

    w = w[..., None]
    n = local(w)

    def mean(f):
        return torch.where(n > 0, local(w * f) / torch.where(n > 0, n, 1), 0)

    a, b = mean(x), mean(y)
    vaa, vbb, vab = mean(x * x) - a * a, mean(y * y) - b * b, mean(x * y) - a * b
    c1, c2 = 0.01**2, 0.03**2
    ssim = (2 * a * b + c1) * (2 * vab + c2) / ((a * a + b * b + c1) * (vaa + vbb + c2))
    return (w * ((1 - structure) * (x - y).abs() + structure * (1 - ssim))).mean()


def pictures(h, w, c, seed=0):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 1, (2, h, w, c)).astype(np.float32)
    weight = (rng.uniform(0, 1.4, (h, w)).clip(0, 1) * (rng.uniform(0, 1, (h, w)) > 0.3)).astype(np.float32)
    weight[: h // 3, : w // 2] = 0  # a hole wider than a window
    return x, (0.7 * x + 0.3 * y).astype(np.float32), weight


@pytest.mark.parametrize("size", [(40, 33, 3), (7, 5, 3), (23, 40, 1), (18, 17, 5)])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("structure", [0.0, 0.2, 1.0])
def test_value_and_gradient_are_the_twins(size, weighted, structure):
    x, y, w = pictures(*size)
    leaf = torch.tensor(x, dtype=torch.float64, requires_grad=True)
    weight = torch.tensor(w if weighted else np.ones_like(w), dtype=torch.float64)
    wanted = twin(leaf, torch.tensor(y, dtype=torch.float64), weight, structure)
    wanted.backward()
    value, gradient = cpu.loss(x, y, w if weighted else None, structure)
    # variances are differences of means of squares: 6e-8 of about 0.3 against C2 = 9e-4
    assert value == pytest.approx(float(wanted.detach()), rel=1e-4)
    np.testing.assert_allclose(gradient, leaf.grad.numpy(), atol=2e-3 * leaf.grad.abs().max())


def test_two_constant_pictures_give_the_value_worked_by_hand():
    x, y = np.full((20, 20, 3), 0.5, np.float32), np.full((20, 20, 3), 0.25, np.float32)
    ssim = (2 * 0.5 * 0.25 + 1e-4) / (0.25 + 0.0625 + 1e-4)  # no variance: the second factor is 1
    assert cpu.loss(x, y)[0] == pytest.approx(0.8 * 0.25 + 0.2 * (1 - ssim), rel=1e-4)


def test_equal_pictures_lose_nothing_and_stay():
    x, _, w = pictures(30, 30, 3)
    for weight in (None, w):
        value, gradient = cpu.loss(x, x, weight)
        assert value == pytest.approx(0, abs=1e-5)
        np.testing.assert_allclose(gradient, 0, atol=1e-6)


def test_pixels_of_weight_zero_have_no_influence_at_all():
    x, y, w = pictures(40, 33, 3)
    value, gradient = cpu.loss(x, y, w)
    hidden = w == 0
    assert hidden.mean() > 0.3
    x[hidden], y[hidden] = 7, -3
    other, same = cpu.loss(x, y, w)
    assert other == value
    np.testing.assert_array_equal(same, gradient)
    assert not gradient[hidden].any()


def test_a_weight_of_ones_is_no_weight_and_half_of_it_half_the_loss():
    x, y, _ = pictures(30, 30, 3)
    value, gradient = cpu.loss(x, y)
    same, equal = cpu.loss(x, y, np.ones((30, 30), np.float32))
    assert (same, equal.tolist()) == (value, gradient.tolist())
    half, lower = cpu.loss(x, y, np.full((30, 30), 0.5, np.float32))
    assert half == pytest.approx(value / 2, rel=1e-6)
    np.testing.assert_allclose(lower, gradient / 2, rtol=1e-5, atol=1e-9)


def test_no_weight_at_all_is_no_loss():
    x, y, _ = pictures(20, 20, 3)
    value, gradient = cpu.loss(x, y, np.zeros((20, 20), np.float32))
    assert value == 0
    assert not gradient.any()


def test_pictures_of_other_sizes_are_refused():
    x, y, w = pictures(20, 20, 3)
    with pytest.raises(ValueError, match="weight must be C-contiguous"):
        cpu.loss(x, y, np.asfortranarray(w))
