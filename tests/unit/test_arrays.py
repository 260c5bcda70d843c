"""Of arrays and of tensors the same comes out, and no value of a tensor is read for it."""

import numpy as np
import pytest
import torch
from fixtures.no_reads import no_reads

from dav_gswt import arrays

MAP = np.random.default_rng(0).normal(size=(9, 14))
CALLS = {
    "blur": lambda v: arrays.blur(v, 0.5),
    "wide blur": lambda v: arrays.blur(v, 2.3),
    "average": lambda v: arrays.average_around(v, 5),
    "lowest": lambda v: arrays.find_lowest_around(v, 3),
    "slope to the east": lambda v: arrays.measure_slopes(v, 0.2)[0],
    "slope to the north": lambda v: arrays.measure_slopes(v, 0.2)[1],
    "median of nine": arrays.median,
    "median of eight": lambda v: arrays.median(v[1:]),
    "median of some": lambda v: arrays.median(v[0], v[0] > 0),
    "median of an even number": lambda v: arrays.median(v[0, :4], v[0, :4] < 9),
    "count": lambda v: arrays.count_up(5, v),
    "single": arrays.to_single,
    "zeros": lambda v: arrays.zeros((2, 3), v),
}


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_tensors_come_out_as_arrays_do(call, dtype):
    values = MAP.astype(dtype)
    wanted, tensor = call(values), torch.tensor(values)
    with no_reads():
        found = call(tensor)
    assert found.numpy().dtype == np.asarray(wanted).dtype
    np.testing.assert_allclose(found.numpy(), wanted, rtol=1e-12 if dtype == np.float64 else 1e-5, atol=1e-6)


def test_a_median_of_nothing_is_nan_and_numbers_are_set_in_place():
    for values in (np.ones(4, np.float32), torch.ones(4)):
        assert np.isnan(float(arrays.median(values, values > 2)))
        arrays.fill(values[1:3], 7)
        assert arrays.on_host(values).tolist() == [1, 7, 7, 1]
        assert type(arrays.put_beside(np.arange(3), values)) is type(values)
