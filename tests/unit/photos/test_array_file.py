"""Arrays that lie in files."""

import gc
import os

import numpy as np
import psutil
import pytest

from dav_gswt.photos import array_file
from dav_gswt.photos.array_file import ArrayFile, release_pages


@pytest.fixture
def arrays(tmp_path):
    return ArrayFile(tmp_path / "made")


@pytest.mark.parametrize(
    "array",
    [
        np.random.default_rng(0).normal(size=(7, 5, 3)).astype(np.float32),
        np.zeros((0, 3), np.float32),
        np.arange(12).reshape(3, 4).T,
        np.array([True, False]),
    ],
)
def test_an_array_of_any_kind_comes_back_as_it_was(arrays, array):
    stored = arrays.store(array)
    assert stored.dtype == array.dtype and np.array_equal(stored, array)
    assert not stored.size or not stored.flags.writeable


def test_arrays_larger_than_a_segment_have_files_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr(array_file, "SEGMENT", 1 << 16)
    arrays = ArrayFile(tmp_path)
    given = [np.full(size, size, np.int64) for size in (100, 40_000, 200)]
    stored = [arrays.store(array) for array in given]
    assert all(np.array_equal(a, b) for a, b in zip(stored, given, strict=True))


def test_the_room_of_an_array_that_is_gone_is_used_again(arrays):
    first = arrays.store(np.zeros(5000))
    view = first[:3]
    del first
    gc.collect()
    second = arrays.store(np.ones(5000))  # a view of the first one is left
    assert view.max() == 0
    del view
    gc.collect()
    end = arrays._segments[0].end
    third = arrays.store(np.full(5000, 2.0))
    assert arrays._segments[0].end == end and second.min() == 1 and third.max() == 2


def test_released_pages_take_no_memory_and_read_as_before(arrays):
    stored = [arrays.store(np.full(1_000_000, i, np.float64)) for i in range(20)]
    process = psutil.Process(os.getpid())
    assert [array.sum() for array in stored] == [i * 1e6 for i in range(20)]
    full = process.memory_info().rss
    for array in stored:
        release_pages(array[10:20])  # by any view of it
    assert full - process.memory_info().rss > 100e6
    assert [array[-1] for array in stored] == list(range(20))
    array = np.arange(5.0)
    release_pages(array[1:])
    assert array.sum() == 10
