"""Timing, sensitivity and ablation by hand-worked rows; the page that shows them."""

import numpy as np
import pytest
from fixtures.markdown import collapse_spaces

from dav_gswt.images import image_files
from dav_gswt.study import csv_tables
from dav_gswt.study.sweeps import tables as sweeps
from dav_gswt.study.tables import ablation, results, sensitivity, spread, timing
from dav_gswt.study.terrain import tile_uncertainty

ROW = dict.fromkeys(sweeps.list_columns(1)) | {"preset": "draft", "tiling": "semantic", "tau": "0.6"}
TWO = [("desert", 0, 30.0), ("desert", 1, 32.0), ("dunes", 0, 20.0), ("dunes", 1, 21.0)]


def cell(value, scene="desert", seed=0, **measured):
    return ROW | {"varied_0": value, "scene": scene, "seed": str(seed)} | measured


def test_means_count_scenes_alike_and_deviations_are_over_seeds():
    rows = [cell("a", scene, seed, psnr=p) for scene, seed, p in TWO]
    assert spread.mean_and_deviation(rows, "psnr") == {
        "psnr": pytest.approx(25.75),
        "psnr_sd": pytest.approx(np.std([25, 26.5], ddof=1)),
    }
    assert spread.mean_and_deviation(rows[:1], "psnr") == {"psnr": 30, "psnr_sd": None}
    assert spread.mean_and_deviation([cell("a")], "psnr") == {"psnr": None, "psnr_sd": None}
    lacking = [*rows, cell("a", "desert", 2, psnr=99.0)]  # a seed that one scene lacks is no seed of all
    assert spread.compute_deviation(lacking, "psnr") == spread.compute_deviation(rows, "psnr")


def test_the_viewer_is_beside_the_bundle_that_it_measured(tmp_path):
    measured = {"scene": "desert", "seed": 0, "preset": "draft", "tiling": "semantic", "tau": 0.6, "render_ms": 5.0}
    csv_tables.write_table(tmp_path / "viewer.csv", [measured])
    viewer = spread.read_viewer(tmp_path / "viewer.csv")
    mine, other = spread.join_viewer([cell("0.6"), cell("0.6") | {"tau": "0.3"}], viewer)
    assert (mine["render_ms"], mine["sort_ms"], other["render_ms"]) == (5, None, None)
    assert spread.read_viewer(None) == spread.read_viewer(tmp_path / "none.csv") == []


def test_sensitivity_has_the_papers_row_of_the_same_value_or_place():
    found = sensitivity.tabulate_sensitivity(
        {"tau": [cell(v, psnr=30.0) for v in ("0.3", "0.6")], "k": [cell(v, psnr=30.0) for v in ("8", "2", "4")]},
        {"tau": "0.6", "k": "4"},
    )
    shown = [(r["setting"], r["value"], r["default"], r["paper_value"], r["paper_psnr"]) for r in found]
    assert shown == [
        ("tau", "0.3", False, "0.3", "29.40±0.08"),
        ("tau", "0.6", True, "0.6", "29.41±0.08"),
        ("k", "2", False, "10", "28.91±0.09"),
        ("k", "4", True, "20", "29.41±0.08"),
        ("k", "8", False, "30", "29.45±0.08"),
    ]


def test_two_values_of_which_the_paper_has_none_stand_alone():
    found = sensitivity.tabulate_sensitivity({"k": [cell(v, psnr=30.0) for v in ("2", "4")]}, {"k": "4"})
    assert [row["paper_value"] for row in found] == [None, None]


def test_variants_are_compared_in_pairs_with_the_baseline_of_their_sweep():
    base = [cell("w2-lpips", scene, seed, psnr=p) for scene, seed, p in TWO]
    mine = [cell("w2", scene, seed, psnr=p + d) for (scene, seed, p), d in zip(TWO, (0.1, 0.2, 0.4, 0.5), strict=True)]
    alone = [cell("single", "desert", 0, psnr=29.0)]
    full, w2, single = ablation.tabulate_ablation({"estimators": base + mine + alone}, {"estimators": "w2-lpips"})
    assert full["psnr_difference"] is None and full["paper_memory_gb"] == "6.2±0.1"
    assert w2["psnr_difference"] == pytest.approx(0.3) and (w2["psnr_units"], w2["psnr_df"]) == (4, 2)
    s = np.sqrt((0.005 + 0.005) / 2)
    assert w2["psnr_t"] == pytest.approx(0.3 / (s / 2)) and w2["psnr_p"] < 0.05 and w2["psnr_holm"] == w2["psnr_p"]
    assert (single["psnr_difference"], single["psnr_df"], single["psnr_p"]) == (pytest.approx(-1), 0, None)
    assert w2["seam_lpips_difference"] is None


def test_of_two_settings_the_last_round_is_compared():
    rows = [cell(v, psnr=20.0 + t + (v == "all"), varied_1=str(t)) for v in ("random", "all") for t in (0, 1, 2)]
    rows = [row for row in rows if (row["varied_0"], row["varied_1"]) != ("all", "2")]  # all are taken in one round
    random, everything = ablation.tabulate_ablation({"budget": rows}, {"budget": "random"})
    assert (random["psnr"], everything["psnr"], everything["psnr_difference"]) == (22, 22, 0)


def test_timing_is_of_one_setting_and_beside_the_family():
    rows = [cell("0.3", cut_s=99.0), cell("0.6", recon_s=120.0, cut_s=5.0, bundle_s=2.0, splats=2e6)]
    (found,) = timing.tabulate_timing(timing.select_setting(rows, "0.6"), {"desert": "desert"})
    assert (found["recon_min"], found["cut_s"], found["presort_s"], found["splats_m"]) == (2, 5, 2, 2)
    assert (found["paper_cut_s"], found["paper_sort_share"], found["render_ms"]) == ("76.6", "92.15%", None)
    assert timing.select_setting(rows, "0.9") == rows[:1]


def test_the_page_holds_the_tables_numbers_and_the_papers_slips(tmp_path):
    base = [cell("w2-lpips", scene, seed, psnr=p) for scene, seed, p in TWO]
    mine = [cell("w2", scene, seed, psnr=p + d) for (scene, seed, p), d in zip(TWO, (0.1, 0.2, 0.4, 0.5), strict=True)]
    timed = [cell("0.6", "desert_pool", recon_s=120.0, cut_s=5.0)]
    varied = [cell(v, psnr=30.0) for v in ("0.3", "0.6")]
    rows = {
        "timing": timing.tabulate_timing(timed, {"desert_pool": "desert"}),
        "sensitivity": sensitivity.tabulate_sensitivity({"tau": varied}, {"tau": "0.6"}),
        "ablation": ablation.tabulate_ablation({"estimators": base + mine}, {"estimators": "w2-lpips"}),
        "lod": [
            {"scene": "desert_pool", "level": n, "mean_scale": 0.01 * (n + 1), "count": 100 - n} for n in (0, 0, 1)
        ],
    }
    for name, table in rows.items():
        csv_tables.write_table(tmp_path / f"{name}.csv", table)
    read = {name: csv_tables.read_table(tmp_path / f"{name}.csv") for name in rows}
    results.write_results(tmp_path / "results.md", read, {"a sphere": "figures/sphere.png"})
    text = collapse_spaces((tmp_path / "results.md").read_text())
    assert "| desert_pool | | 5.5 | 2.00 | 68.5 | 5.0 | 76.6 |" in text
    assert "| tau | **0.6** | 0.6 | 30.00 | 29.41±0.08 |" in text and "| tau | 0.3 |" in text
    assert "| `w2` less `w2-lpips` | PSNR (dB) | 4 | +0.30 | (+0." in text and "| 8.49 (2) |" in text
    assert "| desert_pool | mean scale | 0.0100 | 0.0200 |" in text and "| paper, desert | | 64.2K | 17.3K |" in text
    assert "p = 0.013, not p < 0.01; 68 of 200 views are 2.9 times fewer" in text
    assert "![a sphere](figures/sphere.png)" in text


def test_cells_of_the_terrain_are_as_uncertain_as_their_tiles(tmp_path):
    tiles = [{"uncertainty": n / 16, "chunks": [{"orders": [0, 1, 2] if n > 7 else [0, 2]}]} for n in range(16)]
    manifest = {"tiles": tiles, "salt": 0, "directions": [0, 1, 2]}
    shown, deep = tile_uncertainty.read_cells(manifest, -3, -2, (5, 6))
    assert shown.shape == (5, 6) and (deep == (shown > 7 / 16)).all() and deep.any() and not deep.all()
    assert np.abs(tile_uncertainty.make_walk(50, 16.0)[[0, -1], 0] - [0.5, 16.5]).max() == 0
    tile_uncertainty.write_figure(tmp_path / "uncertainty.png", manifest, 0.5, 6.0)
    assert image_files.read_size(tmp_path / "uncertainty.png")[0] > 900
