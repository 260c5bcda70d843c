"""Curves of costs and their exponents."""

import pytest

from dav_gswt.images import image_files
from dav_gswt.study.scale import growth


def cell(kind, size, **costs):
    return {"kind": kind, growth.KINDS[kind][0]: size, "peak_mb": 100.0} | costs


CELLS = [
    *(cell("gaussians", n, seconds=2e-7 * n) for n in (1000, 100, 10_000)),
    *(cell("candidates", n, seconds=n**2 / 1e4) for n in (10, 100, 1000)),
    *(
        cell("photos", n, megapixels=0.25, gaussians=500, steps=9, prepare_seconds=n, step_seconds=0.1, seconds=n + 9.0)
        for n in (8, 16, 32)
    ),
    *(
        cell("pixels", n, photos=12, gaussians=500, steps=9, prepare_seconds=n, step_seconds=n**0.5, seconds=n)
        for n in (0.25, 1.0, 4.0)
    ),
]


def test_an_exponent_is_that_of_a_power():
    assert growth.fit_exponent([1, 10, 100], [3, 30, 300]) == pytest.approx(1)
    assert growth.fit_exponent([4, 1, 9], [2, 1, 3]) == pytest.approx(0.5)


def test_an_exponent_is_of_the_largest_sizes():
    assert growth.fit_exponent([1, 2, 10, 100, 1000], [5, 5, 10, 100, 1000]) == pytest.approx(1)


def test_rows_are_sorted_by_kind_and_size():
    rows = growth.gather_rows(CELLS)
    assert [row["kind"] for row in rows[::3]] == list(growth.KINDS)
    assert [row["gaussians"] for row in rows if row["kind"] == "gaussians"] == [100, 1000, 10_000]


def test_exponents_are_by_kind_and_cost():
    found = growth.fit_exponents(growth.gather_rows(CELLS))
    assert found["candidates"] == pytest.approx({"seconds": 2, "peak_mb": 0}, abs=1e-9)
    assert found["pixels"]["step_seconds"] == pytest.approx(0.5)


def test_the_page_has_a_table_of_each_kind_that_ends_with_its_exponents():
    text = growth.describe_growth(growth.gather_rows(CELLS))
    tables = text.strip().split("\n\n")
    assert len(tables) == 4
    assert all(table.splitlines()[-1].startswith("| exponent") for table in tables)
    assert "2.00" in tables[3]


def test_a_figure_is_drawn(tmp_path):
    growth.plot_growth(growth.gather_rows(CELLS), tmp_path / "scale.png")
    assert image_files.read_photo(tmp_path / "scale.png").std() > 0.01
