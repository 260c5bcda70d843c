"""L1 + D-SSIM against a plain float64 twin with autograd's gradient, and Adam against PyTorch's: by the core in every
instruction set, by PyTorch's backend, and on a GPU where there is one."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from dav_gswt.raster import adam, backends, loss

ISAS = [] if backends.explain_unavailable("cpu") else backends.load_backend("cpu").instruction_sets()


@pytest.fixture(params=[*ISAS, "torch", "cuda"])
def backend(request, monkeypatch):
    name = "cpu" if request.param in ISAS else request.param
    if why := backends.explain_unavailable(name):
        pytest.skip(f"{name}: {why}")
    if name == "cpu":
        monkeypatch.setenv("DAV_GSWT_ISA", request.param)
    return SimpleNamespace(loss=partial(loss, backend=name), adam=partial(adam, backend=name))


# --- the loss


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


@pytest.mark.parametrize(
    "size, weighted, structure",
    [
        ((40, 33, 3), True, 0.2),
        ((40, 33, 3), False, 0.2),
        ((7, 5, 3), True, 1.0),
        ((23, 40, 1), True, 0.0),
        ((18, 17, 5), False, 1.0),
    ],
)
def test_value_and_gradient_are_the_twins(backend, size, weighted, structure):
    x, y, w = pictures(*size)
    leaf = torch.tensor(x, dtype=torch.float64, requires_grad=True)
    weight = torch.tensor(w if weighted else np.ones_like(w), dtype=torch.float64)
    wanted = twin(leaf, torch.tensor(y, dtype=torch.float64), weight, structure)
    wanted.backward()
    value, gradient = backend.loss(x, y, w if weighted else None, structure)
    # variances are differences of means of squares: 6e-8 of about 0.3 against C2 = 9e-4
    assert value == pytest.approx(float(wanted.detach()), rel=1e-4)
    np.testing.assert_allclose(gradient, leaf.grad.numpy(), atol=2e-3 * leaf.grad.abs().max())


def test_pixels_of_weight_zero_have_no_influence_at_all(backend):
    x, y, w = pictures(40, 33, 3)
    value, gradient = backend.loss(x, y, w)
    hidden = w == 0
    assert hidden.mean() > 0.3
    x[hidden], y[hidden] = 7, -3
    other, same = backend.loss(x, y, w)
    assert other == value
    np.testing.assert_array_equal(same, gradient)
    assert not gradient[hidden].any()
    nothing, still = backend.loss(x, y, np.zeros_like(w))
    assert nothing == 0 and not still.any()


# --- Adam


@pytest.mark.parametrize("shape", [(70,), (9, 4, 3), (1100, 3)])
def test_many_steps_go_where_pytorchs_go(backend, shape):
    rng = np.random.default_rng(0)
    values = rng.normal(size=shape).astype(np.float32)
    leaf = torch.tensor(values, dtype=torch.float64, requires_grad=True)
    plain = torch.optim.Adam([leaf], lr=0.01, betas=(0.8, 0.99), eps=1e-8)
    first, second = np.zeros_like(values), np.zeros_like(values)
    for step in range(1, 60):
        gradient = rng.normal(size=shape).astype(np.float32)
        leaf.grad = torch.tensor(gradient, dtype=torch.float64)
        plain.step()
        backend.adam(values, gradient, first, second, rate=0.01, step=step, betas=(0.8, 0.99), epsilon=1e-8)
    np.testing.assert_allclose(values, leaf.detach().numpy(), atol=2e-6)  # 60 steps of 0.01, 6e-8 of about 1 each


def test_rows_left_out_stay_with_their_moments(backend):
    rng = np.random.default_rng(0)
    start, gradient, first, second = (rng.uniform(1, 2, (200, 3)).astype(np.float32) for _ in range(4))
    rows = rng.uniform(size=200) > 0.5
    every, some = ([a.copy() for a in (start, first, second)] for _ in range(2))
    backend.adam(every[0], gradient, *every[1:], rate=0.1, step=3)
    backend.adam(some[0], gradient, *some[1:], rate=0.1, step=3, rows=rows)
    for all_moved, moved, before in zip(every, some, (start, first, second), strict=True):
        np.testing.assert_array_equal(moved[~rows], before[~rows])
        np.testing.assert_allclose(moved[rows], all_moved[rows], rtol=1e-6)


def test_what_is_no_step_is_refused(backend):
    def step(values, rate=0.1, number=1):
        zeros = np.zeros((5, 3), np.float32)
        backend.adam(values, zeros, zeros.copy(), zeros.copy(), rate=rate, step=number)

    frozen, free = np.zeros((5, 3), np.float32), np.zeros((5, 3), np.float32)
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="counts from 1"):
        step(free, number=0)
    with pytest.raises(ValueError, match="values is read-only"):
        step(frozen)
    with pytest.raises(ValueError, match="one number or 3, one a column, not 5"):
        step(free, rate=np.ones(5, np.float32))
