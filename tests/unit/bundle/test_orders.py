"""Orders: by hand, permutations by falling depth; directions by tau; how many directions a picture needs."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.bundle import direction_search, orders
from dav_gswt.bundle.orders import DirectionRings
from dav_gswt.field import GaussianField, rgb_to_sh

SIDE = 2.0


def ground(seed, stones=300, colours=1.0):
    """A plain of discs, and stones of any colour that stand on it."""
    rng = np.random.default_rng(seed)
    flat = np.stack([*np.meshgrid(*[np.arange(0.0625, SIDE, 0.125)] * 2), np.zeros((16, 16))], -1).reshape(-1, 3)
    means = np.concatenate([flat, rng.random((stones, 3)) * [SIDE, SIDE, 0.2]])
    n = len(means)
    sizes = np.full((n, 3), 0.08)
    sizes[: len(flat), 2] = 0.002
    return GaussianField(
        means.astype(np.float32),
        np.log(sizes).astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        np.full(n, 2.0, np.float32),
        rgb_to_sh((0.5 + colours * (rng.random((n, 3)) - 0.5)).astype(np.float32)),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def test_tau_0_keeps_all_orders_of_every_tile_tau_1_of_none_and_their_number_never_rises():
    rings = DirectionRings()
    for u in (0.0, 0.3, 1.0):
        assert len(rings.select_directions(u, 0.0)) == 17 and len(rings.select_directions(u, 1.0)) == 9
        counts = [len(rings.select_directions(u, tau)) for tau in (0.0, 0.2, 0.3, 0.31, 0.9, 1.0)]
        assert counts == sorted(counts, reverse=True)
    assert DirectionRings((20.0, 45.0), 8).select_directions(0.1, 0.5) == [0, 2, 4, 6, 8, 10, 12, 14, 16]


def test_order_runs_from_back_to_front_and_is_stable():
    means = np.float32([[0, 0, 0], [2, 0, 5], [1, 0, 0], [2, 9, 0]])
    # looking east the largest x is at the back; 1 and 3 are equally deep
    along = np.array([[1.0, 0, 0], [0, 0, -1]])
    assert [orders.sort_back_to_front(means, a).tolist() for a in along] == [[1, 3, 2, 0], [0, 2, 3, 1]]


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.sampled_from([0.0, 1e-30, 1.0, 1e30]))
def test_orders_are_permutations_by_falling_depth(seed, count, size):
    rng = np.random.default_rng(seed)
    means = (size * rng.normal(size=(count, 3))).astype(np.float32)
    for direction in DirectionRings((45.0,), 4).directions():
        found = orders.sort_back_to_front(means, direction)
        assert found.dtype == np.uint32 and (np.sort(found) == np.arange(count)).all()
        assert (np.diff((means.astype(float) @ direction)[found]) <= 0).all()
        if size == 0:
            assert (found == np.arange(count)).all()


def test_directions_are_added_until_the_error_is_small_or_the_room_is_full(monkeypatch):
    monkeypatch.setattr(direction_search, "VIEWS", 2)
    fields = [ground(seed, stones=150) for seed in range(2)]
    few, many = (direction_search.search_directions(fields, SIDE, wanted) for wanted in (15.0, 60.0))
    first, last = (len(rings.select_directions(0.0, 1.0)) for rings in (few, many))
    assert first < last <= direction_search.MAX_ORDERS
    good, bad = (
        min(direction_search.measure_psnr(fields, SIDE, kept, down) for down in direction_search.ELEVATIONS.values())
        for kept in (DirectionRings(rings.elevations, rings.azimuths // 2) for rings in (few, many))
    )
    assert good >= 15.0
    assert bad < 60.0, "no room for what this asks for"
