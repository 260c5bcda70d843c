"""Orders: permutations by falling depth, directions by tau, what they cost and lose."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import bundles
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.bundle import orders, store
from dav_gswt.bundle.orders import DirectionRings


def test_tau_0_keeps_all_orders_of_every_tile_tau_1_of_none_and_their_number_never_rises():
    rings = DirectionRings()
    for u in (0.0, 0.3, 1.0):
        assert len(rings.select_directions(u, 0.0)) == 17 and len(rings.select_directions(u, 1.0)) == 9
        counts = [len(rings.select_directions(u, tau)) for tau in (0.0, 0.2, 0.3, 0.31, 0.9, 1.0)]
        assert counts == sorted(counts, reverse=True)
    assert DirectionRings((20.0, 45.0), 8).select_directions(0.1, 0.5) == [0, 2, 4, 6, 8, 10, 12, 14, 16]


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


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle") / "b"
    bundles.write_bundle(folder, bundles.Ground(discs=8, things=20, speckle=40))
    return store.read_bundle(folder)


def with_orders(bundle, kept):
    tiles = [replace(tile, orders=kept) for tile in bundle.manifest.tiles]
    return replace(bundle, manifest=replace(bundle.manifest, tiles=tiles))


def test_orders_are_counted_and_more_of_them_lose_less(bundle):
    few, many = (orders.measure_orders(with_orders(bundle, kept)) for kept in ([8], list(range(9))))
    assert (few["orders"], many["orders"]) == (16 * 2, 9 * 16 * 2)
    # 64 and 16 discs, 20 things at both levels, 4 bytes each
    assert few["order_mb"] == pytest.approx(4 * 16 * (64 + 16 + 40) / 1e6)
    assert many["order_mb"] == pytest.approx(9 * few["order_mb"])
    assert 10 < few["order_db"] < many["order_db"]
    assert min(each[key] for each in (few, many) for key in ("compose_s", "sort_s")) >= 0
