import pytest

from dav_gswt_study.scale import growth


def cell(kind, size, **costs):
    return {"kind": kind, growth.KINDS[kind][0]: size, "peak_mb": 100.0} | costs


def fit(kind, size, **costs):
    about = {"photos": 12, "megapixels": 0.25, "gaussians": 500, "steps": 9, "prepare_seconds": size} | costs
    return cell(kind, size, **(about | {growth.KINDS[kind][0]: size}))


CELLS = [
    *(cell("gaussians", n, seconds=2e-7 * n) for n in (1000, 100, 10_000)),
    *(cell("candidates", n, seconds=n**2 / 1e4) for n in (10, 100, 1000)),
    *(cell("tiles", n, seconds=n / 1e6) for n in (100, 1000, 10_000)),
    *(fit("photos", n, step_seconds=0.1, seconds=n + 9.0) for n in (8, 16, 32)),
    *(fit("pixels", n, step_seconds=n**0.5, seconds=n) for n in (0.25, 1.0, 4.0)),
    *(fit("limits", n, step_seconds=n / 1e4, seconds=n) for n in (500, 1000, 2000)),
    *({"kind": "threads", "threads": n, "seconds": 10.0 - 4 * (n - 1), "step_seconds": 0.1} for n in (1, 2)),
]


def test_exponents_are_those_of_powers_over_the_largest_sizes_by_kind_and_cost():
    assert growth.fit_exponent([4, 1, 9], [2, 1, 3]) == pytest.approx(0.5)
    assert growth.fit_exponent([1, 2, 10, 100, 1000], [5, 5, 10, 100, 1000]) == pytest.approx(1)
    found = growth.fit_exponents(growth.gather_rows(CELLS))
    assert found["candidates"] == pytest.approx({"seconds": 2, "peak_mb": 0}, abs=1e-9)
    assert found["pixels"]["step_seconds"] == pytest.approx(0.5)


def test_costs_are_extrapolated_by_photos_pixels_and_cores_from_the_share_that_runs_beside_itself():
    assert growth.find_parallel_share(growth.gather_rows(CELLS)) == pytest.approx(0.8)
    lines = growth.extrapolate(growth.gather_rows(CELLS), 1000, cores=(2, 4)).splitlines()
    # 41 s with 32 photos; four megapixels take four times as long as one; .6 of the time on two threads, .4 on four
    assert [line.split()[1::2] for line in lines[2:]] == [["2", "1", "3"], ["4", "0", "2"]]
