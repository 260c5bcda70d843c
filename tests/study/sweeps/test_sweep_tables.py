"""A cell as a row: what it measured, what it cost, what is not known; rows that add up, and their figure."""

import json

import pytest

from dav_gswt.images import image_files
from dav_gswt.study import csv_tables
from dav_gswt.study.seams import measure
from dav_gswt.study.sweeps import plots, tables

CELL = dict(
    sweep="tau", scene="desert", seed=0, preset="draft", policy="farthest", prior="none", p_drop="0", lam="0", k=4,
    rounds=2, tiling="semantic", tau="0.6", samples=0, steps=0, corrected=False, varied={"tau": 0.6},
)  # fmt: skip
ORIGIN = {"version": "1", "renderer": {"backend": "cpu", "isa": "x"}, "inputs": {"field": "f" * 64, "seams": "t" * 64}}


def metrics(folder, **groups):
    mean = {"psnr": 20.0, "psnr_colour_corrected": 21.0, "ssim": 0.5, "lpips": 0.25}
    metrics_json = mean | {"worst_decile": {"psnr": 15.0, "psnr_colour_corrected": 16.0}, "groups": groups}
    (path := folder / "metrics.json").write_text(
        json.dumps(metrics_json | {"photos": 16, "gaussians": 9, "provenance": ORIGIN})
    )
    return str(path)


def manifest(folder):
    chunks = [{"count": 10, "bytes": 500_000, "orders": [0, 1, 2]}, {"count": 2, "bytes": 100_000, "orders": [0]}]
    shallow = [{"count": 4, "bytes": 200_000, "orders": [0, 2]}, {"count": 1, "bytes": 50_000, "orders": [0]}]
    tiles = [{"uncertainty": u, "chunks": c} for u, c in ((0.8, chunks), (0.2, shallow))]
    manifest = {"tiles": tiles, "levels": [{}, {}], "directions": [0, 1, 2], "provenance": ORIGIN}
    (path := folder / "davgswt.json").write_text(json.dumps(manifest))
    return str(path)


def crops(folder):
    at = {"view": "top", "ground": "flat", "psnr": 30.0, "jump": 1.5}
    rows = [
        at | {"place": place, "crop": n, "cluster": str(n), "seam_lpips": value + n / 100}
        for n in range(4)
        for place, value in (("cut", 0.3), ("floor", 0.1))
    ]
    csv_tables.write_table(folder / "crops.csv", [{key: row[key] for key in measure.COLUMNS} for row in rows])
    (folder / "facts.json").write_text(json.dumps({"dense": 0.4, "provenance": ORIGIN}))
    return {"crops": str(folder / "crops.csv"), "facts": str(folder / "facts.json")}


def benchmarks(folder, **jobs):
    found = {}
    for job, seconds in jobs.items():
        found[job] = []
        for number, (s, memory) in enumerate(seconds):
            (path := folder / f"{job}{number}.tsv").write_text(f"s\th:m:s\tmax_rss\n{s}\t0:00\t{memory}\n")
            found[job].append(str(path))
    return found


def test_a_row_holds_what_was_measured_and_where_it_comes_from(tmp_path):
    files = {"metrics": metrics(tmp_path), "manifest": manifest(tmp_path)} | crops(tmp_path)
    row = tables.tabulate_cell(CELL | {"files": files, "times": {}})
    assert tuple(row) == tables.list_columns(1)
    assert (row["psnr"], row["worst_psnr"], row["photos"], row["psnr_is"]) == (20, 15, 16, "raw")
    assert (row["uncertainty"], row["deep"], row["levels"], row["splats"]) == (0.5, 0.5, 2, 17)
    assert (row["orders"], row["bundle_mb"]) == (3 + 1 + 2 + 1, 0.85)
    assert row["seam_lpips"] == pytest.approx(0.2) and row["seam_density"] == 0.4 and row["seam_psnr"] == 30
    assert (row["field"], row["tiles"], row["renderer"]) == (12 * "f", 12 * "t", "cpu x")


def test_photos_are_measured_with_their_exposure_fitted(tmp_path):
    row = tables.tabulate_cell(CELL | {"corrected": True, "files": {"metrics": metrics(tmp_path)}, "times": {}})
    assert (row["psnr"], row["worst_psnr"], row["psnr_is"]) == (21, 16, "colour-corrected")


def test_what_was_not_measured_is_empty(tmp_path):
    row = tables.tabulate_cell(CELL | {"files": {"metrics": metrics(tmp_path)}, "times": {}})
    assert not [row[key] for key in (*tables.TILES, *tables.SEAMS, *tables.TIMES) if row[key] is not None]


def test_seconds_are_those_of_a_round_and_of_all_that_leads_to_the_field(tmp_path):
    jobs = benchmarks(
        tmp_path, coarse=[(10, 300)], score=[(4, 700), (6, "NA")], select=[(1, 10), (1, 10)], capture=[(99, 50)],
        update=[(5, 400), (7, 400)], cut=[(3, 200)],
    )  # fmt: skip
    found = tables.sum_times(jobs)
    assert (found["score_s"], found["select_s"], found["update_s"], found["cut_s"]) == (5, 1, 6, 3)
    assert (found["recon_s"], found["peak_mb"], found["bundle_s"]) == (10 + 10 + 2 + 12, 700, None)


def test_a_job_without_a_benchmark_makes_its_seconds_unknown(tmp_path):
    jobs = benchmarks(tmp_path, coarse=[(10, 300)]) | {"score": [str(tmp_path / "gone.tsv")]}
    found = tables.sum_times(jobs)
    assert (found["coarse_s"], found["score_s"], found["recon_s"], found["peak_mb"]) == (10, None, None, 300)
    assert tables.sum_times({"coarse": [], "score": []})["recon_s"] is None


def rows(tmp_path, **more):
    row = tables.tabulate_cell(CELL | {"files": {"metrics": metrics(tmp_path)}, "times": {}})
    return row | more


def test_rows_of_several_runs_add_up(tmp_path):
    path = tmp_path / "kept.csv"
    csv_tables.write_table(path, [rows(tmp_path), rows(tmp_path, tau="0.3", psnr=10.0)])
    new = [rows(tmp_path, tau="0.3", psnr=30.0), rows(tmp_path, seed=1)]
    csv_tables.update_table(path, new, tables.KEY)
    found = {(row["tau"], row["seed"]): row["psnr"] for row in tables.read_sweep(path)}
    assert found == {("0.3", "0"): 30, ("0.6", "0"): 20, ("0.6", "1"): 20}


def test_the_figure_shows_each_measure_and_curves_where_rounds_are_varied_too(tmp_path):
    one = [rows(tmp_path, varied_0=value, psnr=p, recon_s=1.0) for value, p in (("0.3", 20.0), ("0.6", 21.0))]
    figure = plots.draw_figure("tau", ["tau"], one)
    labels = [axes.get_ylabel() for axes in figure.axes if axes.axison]
    assert labels == [plots.PANELS[key] for key in ("psnr", "worst_psnr", "lpips", "recon_s")]
    two = [
        rows(tmp_path, varied_0=policy, varied_1=str(t), photos=8 + 4 * t, psnr=20.0 + t)
        for policy in ("farthest", "random")
        for t in (0, 1, 2)
    ]
    figure = plots.draw_figure("budget", ["policy", "rounds"], two)
    curves = figure.axes[0].get_lines()
    assert [list(line.get_ydata()) for line in curves] == [[20, 21, 22]] * 2
    assert all(dot == 22 for line in figure.axes[1].get_lines() for dot in line.get_ydata())  # the last round's
    plots.write_figure(tmp_path / "budget.png", "budget", ["policy", "rounds"], two)
    assert image_files.read_size(tmp_path / "budget.png")[0] > 600
