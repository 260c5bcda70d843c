"""Curves of costs and their exponents."""

import pytest

from dav_gswt.images import image_files
from dav_gswt.study import markdown
from dav_gswt.study.scale import growth, page


def cell(kind, size, **costs):
    return {"kind": kind, growth.KINDS[kind][0]: size, "peak_mb": 100.0} | costs


CELLS = [
    *(cell("gaussians", n, seconds=2e-7 * n) for n in (1000, 100, 10_000)),
    *(cell("candidates", n, seconds=n**2 / 1e4) for n in (10, 100, 1000)),
    *(cell("tiles", n, seconds=n / 1e6) for n in (100, 1000, 10_000)),
    *(
        cell("photos", n, megapixels=0.25, gaussians=500, steps=9, prepare_seconds=n, step_seconds=0.1, seconds=n + 9.0)
        for n in (8, 16, 32)
    ),
    *(
        cell("pixels", n, photos=12, gaussians=500, steps=9, prepare_seconds=n, step_seconds=n**0.5, seconds=n)
        for n in (0.25, 1.0, 4.0)
    ),
    *(
        cell("limits", n, photos=12, megapixels=3, steps=9, prepare_seconds=n / 1e3, step_seconds=n / 1e4, seconds=n)
        for n in (500, 1000, 2000)
    ),
    *(
        {"kind": "threads", "threads": n, "seconds": 10.0 - 4 * (n - 1), "step_seconds": 0.1, "peak_mb": 1.0}
        for n in (1, 2)
    ),
]


def test_an_exponent_is_that_of_a_power():
    assert growth.fit_exponent([1, 10, 100], [3, 30, 300]) == pytest.approx(1)
    assert growth.fit_exponent([4, 1, 9], [2, 1, 3]) == pytest.approx(0.5)


def test_an_exponent_is_of_the_largest_sizes():
    assert growth.fit_exponent([1, 2, 10, 100, 1000], [5, 5, 10, 100, 1000]) == pytest.approx(1)


def test_rows_are_sorted_by_kind_and_size():
    rows = growth.gather_rows(CELLS)
    assert [row["kind"] for row in rows[:18:3]] == list(growth.KINDS)
    assert [row["gaussians"] for row in rows if row["kind"] == "gaussians"] == [100, 1000, 10_000]


def test_exponents_are_by_kind_and_cost():
    found = growth.fit_exponents(growth.gather_rows(CELLS))
    assert found["candidates"] == pytest.approx({"seconds": 2, "peak_mb": 0}, abs=1e-9)
    assert found["pixels"]["step_seconds"] == pytest.approx(0.5)


def test_a_table_ends_with_its_exponents():
    rows = growth.gather_rows(CELLS)
    assert growth.describe_kind(rows, "candidates").splitlines()[-1].split()[1::2] == ["exponent", "2.00", "0.00"]
    assert growth.describe_kind(rows, "pixels").splitlines()[2].split()[1] == "0.25"


def test_what_grows_is_counted_once_in_a_table():
    head = growth.describe_kind(growth.gather_rows(CELLS), "limits").splitlines()[0]
    assert [part.strip() for part in head.split("|")[1:4]] == ["Gaussians of the fit", "steps", "s"]


def test_the_share_that_runs_beside_itself_follows_from_one_and_two_threads():
    assert growth.find_parallel_share(growth.gather_rows(CELLS)) == pytest.approx(0.8)


def test_costs_are_extrapolated_by_photos_pixels_and_cores():
    lines = growth.extrapolate(growth.gather_rows(CELLS), 1000, cores=(2, 4)).splitlines()
    # 41 s with 32 photos; four megapixels take four times as long as one; .6 of the time on two threads, .4 on four
    assert [line.split()[1::2] for line in lines[2:]] == [["2", "1", "3"], ["4", "0", "2"]]


def test_the_page_is_filled(root):
    made = {"renderer": {"name": "cpu"}, "version": "1.0", "processor": "a processor", "cores": 2}
    rows, cells = growth.gather_rows(CELLS), [cell | {"made": made} for cell in CELLS]
    asked = {
        "scene": "desert",
        "preset": "standard",
        "size": 1000,
        "pixels_of_limits": 64,
        "photos_of_pixels": 12,
        "steps_of_pixels": 9,
        "photos": [8, 16, 32],
    }
    values = page.describe(rows, cells, asked, {"max_gaussians": 500, "steps_per_photo": 20})
    text = markdown.render_template(root / "workflow/report/scale.md", values)
    assert "2 cores of a processor" in text and "80 % of the work" in text


def test_a_figure_is_drawn(tmp_path):
    growth.plot_growth(growth.gather_rows(CELLS), tmp_path / "scale.png")
    assert image_files.read_photo(tmp_path / "scale.png").std() > 0.01
