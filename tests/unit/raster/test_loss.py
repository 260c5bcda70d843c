import numpy as np
import pytest
import torch

from dav_gswt.raster import cpu


def slow_loss(image, photo, weight, structure):
    """The same loss in float64 PyTorch, from its definition."""
    target = (image + weight[..., None] * (photo - image)).detach()
    taps = torch.exp(-((torch.arange(11, dtype=torch.float64) - 5) ** 2) / 4.5)
    kernel = torch.outer(taps, taps) / taps.sum() ** 2
    planes = image.movedim(-1, 0)[:, None], target.movedim(-1, 0)[:, None]

    def blur(x):
        return torch.nn.functional.conv2d(x, kernel[None, None], padding=5)

    a, t = planes
    u, v = blur(a), blur(t)
    va, vt, cov = blur(a * a) - u * u, blur(t * t) - v * v, blur(a * t) - u * v
    ssim = (2 * u * v + 1e-4) * (2 * cov + 9e-4) / ((u * u + v * v + 1e-4) * (va + vt + 9e-4))
    return (1 - structure) * (weight[..., None] * (image - photo).abs()).mean() + structure * (1 - ssim).mean()


@pytest.fixture
def pictures():
    rng = np.random.default_rng(0)
    weight = np.ones((37, 45), np.float32)
    weight[:9] = 0
    weight[9:12] = 0.5
    return [rng.uniform(size=(37, 45, 3)).astype(np.float32) for _ in range(2)] + [weight]


@pytest.mark.parametrize("structure", [0.0, 0.2, 1.0])
def test_loss_and_gradient_equal_the_definition(pictures, structure):
    image, photo, weight = pictures
    value, gradient = cpu.Rasterizer().loss(image, photo, weight, structure)
    leaf = torch.tensor(image, dtype=torch.float64, requires_grad=True)
    true = slow_loss(leaf, torch.tensor(photo, dtype=torch.float64), torch.tensor(weight, dtype=torch.float64), structure)
    true.backward()
    expected = leaf.grad.numpy() * (weight > 0)[..., None]
    assert value == pytest.approx(float(true.detach()), rel=1e-4)
    np.testing.assert_allclose(gradient, expected, atol=2e-4 * np.abs(expected).max())


def test_pixels_of_weight_0_change_nothing(pictures):
    image, photo, weight = pictures
    other = photo.copy()
    other[:9] = 0
    a, b = (cpu.Rasterizer().loss(image, p, weight, 0.2) for p in (photo, other))
    assert a[0] == b[0]
    np.testing.assert_array_equal(a[1], b[1])
    assert not a[1][:9].any()


def test_a_picture_equal_to_its_photo_has_no_loss(pictures):
    image, _, weight = pictures
    value, gradient = cpu.Rasterizer().loss(image, image.copy(), weight, 0.2)
    assert value == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(gradient, 0, atol=1e-7)


def test_adam_equals_pytorchs():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(50, 3)).astype(np.float32)
    leaf = torch.tensor(values.copy(), requires_grad=True)
    optimiser = torch.optim.Adam([leaf], lr=0.01, eps=1e-15)
    first, second = np.zeros_like(values), np.zeros_like(values)
    for step in range(1, 20):
        gradient = rng.normal(size=(50, 3)).astype(np.float32)
        cpu.adam(values, gradient, first, second, rate=0.01, step=step)
        leaf.grad = torch.tensor(gradient)
        optimiser.step()
    np.testing.assert_allclose(values, leaf.detach().numpy(), atol=1e-6)


def test_adams_steps_count_from_1():
    a = np.zeros(3, np.float32)
    with pytest.raises(ValueError, match="count from 1"):
        cpu.adam(a, a, a, a, rate=0.1, step=0)
