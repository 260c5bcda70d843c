"""Tables of sweeps and of timing, from files that a run would leave."""

import json

from dav_gswt import sweeps

CELL = dict(
    scene="desert", seed=0, preset="draft", policy="w2-lpips", prior="terrain", p_drop="0.15", lam="0.1", k=4,
    rounds=2, tiling="auto", tau="0.6", corrected=False,
)  # fmt: skip
ORIGIN = {"version": "1", "renderer": {"backend": "cpu", "isa": "x"}, "inputs": {"field": "f" * 64, "seams": "t" * 64}}


def metrics(folder):
    mean = {"psnr": 20.0, "psnr_colour_corrected": 21.0, "ssim": 0.5, "lpips": 0.25, "groups": {}}
    mean |= {"worst_decile": {"psnr": 15.0, "psnr_colour_corrected": 16.0}, "photos": 16, "gaussians": 9}
    (path := folder / "metrics.json").write_text(json.dumps(mean | {"provenance": ORIGIN}))
    return str(path)


def manifest(folder):
    deep = {"uncertainty": 0.8, "orders": [0, 1, 2], "chunks": [{"count": 10}, {"count": 2}]}
    shallow = {"uncertainty": 0.2, "orders": [0, 2], "chunks": [{"count": 4}, {"count": 1}]}
    manifest = {"tiles": [deep, shallow], "levels": [{}, {}], "directions": [0, 1, 2], "provenance": ORIGIN}
    manifest["parts"] = [{"bytes": 800_000}, {"bytes": 50_000}]
    (path := folder / "davgswt.json").write_text(json.dumps(manifest))
    return str(path)


def orders(folder):
    measured = {"orders": 10, "order_mb": 2.5, "order_db": None, "compose_s": 0.5, "sort_s": 0.25}
    (path := folder / "orders.json").write_text(json.dumps(measured | {"provenance": ORIGIN}))
    return str(path)


def test_a_row_has_quality_tiles_and_their_origin(tmp_path):
    files = {"metrics": metrics(tmp_path), "manifest": manifest(tmp_path), "orders": orders(tmp_path)}
    row = sweeps.tabulate_cell(CELL | {"files": files, "times": {}})
    assert (row["psnr"], row["worst_psnr"], row["photos"], row["psnr_is"]) == (20, 15, 16, "raw")
    assert (row["uncertainty"], row["deep"], row["levels"], row["splats"]) == (0.5, 0.5, 2, 17)
    assert (row["bundle_mb"], row["field"], row["renderer"]) == (0.85, 12 * "f", "cpu x")
    assert [row[key] for key in sweeps.ORDERS] == [10, 2.5, None, 0.5, 0.25]
    row = sweeps.tabulate_cell(CELL | {"corrected": True, "files": {"metrics": files["metrics"]}, "times": {}})
    assert (row["psnr"], row["worst_psnr"], row["psnr_is"]) == (21, 16, "colour-corrected")
    assert not [row[key] for key in (*sweeps.TILES, *sweeps.ORDERS, *sweeps.TIMES) if row[key] is not None]


def test_the_timing_table_has_means_over_seeds_and_none_for_what_was_not_timed(tmp_path):
    cells = []
    for seed, seconds in enumerate((60.0, 120.0)):
        (path := tmp_path / f"coarse{seed}.tsv").write_text(f"s\tmax_rss\n{seconds}\t100\n")
        times = {"coarse": [str(path)]}
        files = {"metrics": metrics(tmp_path), "manifest": manifest(tmp_path)}
        cells.append(CELL | {"seed": seed, "files": files, "times": times})
    (row,) = sweeps.tabulate_timing(cells)
    assert (row["seeds"], row["recon_min"], row["splats_m"], row["peak_mb"]) == (2, 1.5, 17e-6, 100)
    assert row["cut_s"] is None and row["presort_s"] is None


def test_seconds_are_those_of_a_round_and_of_all_that_leads_to_the_field(tmp_path):
    jobs = {"coarse": [(10, 300)], "score": [(4, 700), (6, "NA")], "select": [(1, 10), (1, 10)], "capture": [(99, 50)]}
    jobs |= {"update": [(5, 400), (7, 400)], "cut": [(3, 200)]}
    paths = {job: [str(tmp_path / f"{job}{k}.tsv") for k in range(len(runs))] for job, runs in jobs.items()}
    for job, runs in jobs.items():
        for path, (seconds, memory) in zip(paths[job], runs, strict=True):
            (tmp_path / path).write_text(f"s\th:m:s\tmax_rss\n{seconds}\t0:00\t{memory}\n")
    found = sweeps.sum_times(paths)
    assert (found["score_s"], found["select_s"], found["update_s"], found["cut_s"]) == (5, 1, 6, 3)
    assert (found["recon_s"], found["peak_mb"], found["bundle_s"]) == (10 + 10 + 2 + 12, 700, None)
    found = sweeps.sum_times({"coarse": paths["coarse"], "score": [str(tmp_path / "gone.tsv")]})
    assert (found["coarse_s"], found["score_s"], found["recon_s"], found["peak_mb"]) == (10, None, None, 300)
    assert sweeps.sum_times({"coarse": [], "score": []})["recon_s"] is None
