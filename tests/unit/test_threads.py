"""Work in threads: results come in order, and only a few of them wait."""

import threading

import pytest

from dav_gswt.threads import map_ahead


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_the_order_of_the_items(threads):
    assert list(map_ahead(lambda item: item * item, range(7), threads)) == [0, 1, 4, 9, 16, 25, 36]


def test_the_next_items_are_worked_on_while_one_is_taken():
    both = threading.Barrier(2, timeout=10)  # broken unless two threads meet here
    assert list(map_ahead(lambda item: both.wait() >= 0, range(4), 2)) == [True] * 4


def test_no_more_results_wait_than_there_are_threads():
    begun = []
    for taken, _ in enumerate(map_ahead(begun.append, range(20), 3), start=1):
        assert len(begun) <= taken + 3


def test_an_error_arises_where_its_result_is_taken():
    results = map_ahead(lambda item: 1 // item, [1, 0], 1)
    assert next(results) == 1
    with pytest.raises(ZeroDivisionError):
        next(results)
