"""Adam against PyTorch's."""

import numpy as np
import pytest
import torch

from dav_gswt.raster import cpu


@pytest.fixture(autouse=True)
def in_every_instruction_set(isa, monkeypatch):
    monkeypatch.setenv("DAV_GSWT_ISA", isa)


def test_the_first_step_has_the_length_of_the_rate():
    values, zeros = np.zeros(3, np.float32), np.zeros((2, 3), np.float32)
    cpu.adam(values, np.array([5, -0.01, 0], np.float32), *zeros, rate=0.1, step=1)
    np.testing.assert_allclose(values, [-0.1, 0.1, 0], rtol=1e-5)


@pytest.mark.parametrize("shape", [(50, 3), (70,), (9, 4, 3)])
def test_many_steps_go_where_pytorchs_go(shape):
    rng = np.random.default_rng(0)
    values = rng.normal(size=shape).astype(np.float32)
    leaf = torch.tensor(values, dtype=torch.float64, requires_grad=True)
    twin = torch.optim.Adam([leaf], lr=0.01, betas=(0.8, 0.99), eps=1e-8)
    first, second = np.zeros_like(values), np.zeros_like(values)
    for step in range(1, 60):
        gradient = rng.normal(size=shape).astype(np.float32)
        leaf.grad = torch.tensor(gradient, dtype=torch.float64)
        twin.step()
        cpu.adam(values, gradient, first, second, rate=0.01, step=step, betas=(0.8, 0.99), epsilon=1e-8)
    np.testing.assert_allclose(values, leaf.detach().numpy(), atol=2e-6)  # 60 steps of 0.01, 6e-8 of about 1 each


def test_rows_left_out_stay_with_their_moments():
    rng = np.random.default_rng(0)
    start, gradient, first, second = (rng.uniform(1, 2, (200, 3)).astype(np.float32) for _ in range(4))
    rows = rng.uniform(size=200) > 0.5
    every, some = ([a.copy() for a in (start, first, second)] for _ in range(2))
    cpu.adam(every[0], gradient, *every[1:], rate=0.1, step=3)
    cpu.adam(some[0], gradient, *some[1:], rate=0.1, step=3, rows=rows)
    for all_moved, moved, before in zip(every, some, (start, first, second), strict=True):
        np.testing.assert_array_equal(moved[~rows], before[~rows])
        np.testing.assert_allclose(moved[rows], all_moved[rows], rtol=1e-6)


def test_steps_count_from_one():
    zeros = np.zeros(3, np.float32)
    with pytest.raises(ValueError, match="counts from 1"):
        cpu.adam(zeros, zeros, zeros, zeros, rate=0.1, step=0)


def test_values_that_cannot_be_changed_are_refused():
    frozen, zeros = np.zeros(3, np.float32), np.zeros(3, np.float32)
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="values is read-only"):
        cpu.adam(frozen, zeros, zeros, zeros, rate=0.1, step=1)


@pytest.mark.parametrize("shape", [(3, 5), (100, 3), (700, 4, 3)])
@pytest.mark.parametrize("some", [False, True])
def test_a_column_with_a_rate_of_its_own_goes_as_if_all_had_that_rate(shape, some):
    rng = np.random.default_rng(0)
    columns = int(np.prod(shape[1:]))
    rates = rng.uniform(0.01, 0.1, columns).astype(np.float32)
    gradient, start = (rng.normal(size=shape).astype(np.float32) for _ in range(2))
    rows = rng.uniform(size=shape[0]) < 0.5 if some else None

    def moved(rate):
        value, first, second = start.copy(), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        cpu.adam(value, gradient, first, second, rate=rate, step=2, rows=rows)
        return value.reshape(shape[0], -1)

    found = moved(rates)
    for column, rate in enumerate(rates):
        # the same products; a compiler may fuse them otherwise
        np.testing.assert_allclose(found[:, column], moved(float(rate))[:, column], rtol=1e-6, atol=1e-7)


def test_rates_that_do_not_fit_are_refused():
    arrays = [np.zeros((5, 3), np.float32) for _ in range(4)]
    with pytest.raises(ValueError, match="one number or 3, one a column, not 5"):
        cpu.adam(*arrays, rate=np.ones(5, np.float32), step=1)
