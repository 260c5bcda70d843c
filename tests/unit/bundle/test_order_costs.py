"""What the orders of a bundle cost and lose: counted by hand, and less where there are more."""

from dataclasses import replace

import pytest
from fixtures import bundles

from dav_gswt.bundle import orders as costs
from dav_gswt.bundle import store


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle") / "b"
    bundles.write_bundle(folder, bundles.Ground(discs=8, things=20, speckle=40))
    return store.read_bundle(folder)


def with_orders(bundle, orders):
    tiles = [replace(tile, orders=orders) for tile in bundle.manifest.tiles]
    return replace(bundle, manifest=replace(bundle.manifest, tiles=tiles))


def test_orders_are_counted_and_more_of_them_lose_less(bundle):
    few, many = (costs.measure_orders(with_orders(bundle, orders)) for orders in ([8], list(range(9))))
    assert (few["orders"], many["orders"]) == (16 * 2, 9 * 16 * 2)
    # 64 and 16 discs, 20 things at both levels, 4 bytes each
    assert few["order_mb"] == pytest.approx(4 * 16 * (64 + 16 + 40) / 1e6)
    assert many["order_mb"] == pytest.approx(9 * few["order_mb"])
    assert 10 < few["order_db"] < many["order_db"]
    assert min(each[key] for each in (few, many) for key in ("compose_s", "sort_s")) >= 0
