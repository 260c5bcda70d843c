"""From rounds to curves, from curves to results and comparisons: rows by hand, and what may not be paired."""

import json

import numpy as np
import pytest

from dav_gswt.study import csv_tables
from dav_gswt.study.comparison import curves, plots, tables
from dav_gswt.views import marginal_gain

CELL = dict(scene="flowers", seed=0, preset="draft", policy="farthest", prior="none", p_drop="0", lam="0", k=4)


def rounds(psnr, photos=(8, 12, 16), **cell):
    rest = {"ssim": 0.8, "lpips": None, "worst_psnr": 20.0, "walker_psnr": None, "seconds": 2.0, "evaluations": 10}
    about = {"version": "1", "renderer": "cpu", "field": "f"} | dict.fromkeys(curves.EXPECTED)
    return [
        CELL | cell | {"round": t, "photos": n, "psnr": float(p)} | rest | about
        for t, (n, p) in enumerate(zip(photos, psnr, strict=True))
    ]


ALL = rounds([20, 26], (8, 48), policy="all")


def compare(table, baseline, measure="psnr"):
    """The comparison by one measure."""
    return [row for row in tables.compare_to_baseline(table, baseline) if row["measure"] == measure]


def fit(gap, photos=4):
    rows = [{"psnr_before": 20.0 - gap} for _ in range(photos)]
    new = {"photos": photos, "taken": True, "views": rows}
    return {"new_views": new, "earlier_views": {"psnr_before": 20.0}}


def metrics(folder, t, **groups):
    mean = {"psnr": 20.0 + t, "psnr_colour_corrected": 21.0 + t, "ssim": 0.5, "lpips": 0.25}
    metrics = mean | {"worst_decile": mean, "groups": groups, "photos": 8 + 4 * t, "fit": fit(5.0) if t else {}}
    metrics |= {"provenance": {"version": "0.1", "renderer": {"backend": "cpu"}, "inputs": {"field": 64 * "a"}}}
    (path := folder / f"metrics{t}.json").write_text(json.dumps(metrics))
    return str(path)


def cell(folder, rounds=2, **given):
    (facts := folder / "scores.json").write_text(json.dumps({"poses_by_steps": {"2": 30, "8": 10}}))
    (time := folder / "job.tsv").write_text("s\th:m:s\n1.5\t0:00:01\n")
    files = {"facts": [str(facts)] * (rounds - 1), "times": [[str(time), str(time)]] * (rounds - 1)}
    files |= {"metrics": [metrics(folder, t) for t in range(rounds)]}
    return CELL | {"corrected": False, "samples": 5} | files | given


def test_a_row_a_round_with_what_it_cost(tmp_path):
    start, first = curves.read_cell(cell(tmp_path))
    assert (start["round"], start["photos"], start["psnr"], start["seconds"], start["evaluations"]) == (0, 8, 20, 0, 0)
    assert (first["round"], first["photos"], first["psnr"], first["seconds"]) == (1, 12, 21, 3)
    assert first["evaluations"] == 5 * (2 * 30 + 8 * 10) and first["field"] == 12 * "a"
    assert curves.read_cell(cell(tmp_path, corrected=True))[0]["psnr"] == 21


def test_what_a_round_was_expected_to_gain_rests_on_the_rounds_before_it_alone(tmp_path):
    start, first, second = curves.read_cell(cell(tmp_path, rounds=3))
    assert start["expected"] is first["expected"] is None
    assert second["closes"] == pytest.approx(8 * 5.0 * (1 / 12 - 1 / 16))
    assert second["expected"] == pytest.approx(marginal_gain.SHARE * second["closes"])
    assert second["expected_low"] < second["expected"] < second["expected_high"]


def test_gains_are_checked_against_what_was_expected_of_them():
    curve = rounds([20.0, 21.0, 21.4, 21.5], (8, 12, 16, 20)) + rounds([20.0, 23.0, 25.0], scene="grass") + ALL
    for row, (low, high) in zip((curve[2], curve[3], curve[6]), ((0.2, 0.8), (0.2, 0.8), (1, 3)), strict=True):
        row |= {"closes": 1.0, "expected": 0.5, "expected_low": low, "expected_high": high}
    every, flowers, grass = tables.check_predictions(curve)
    assert [row["scene"] for row in (every, flowers, grass)] == ["every", "flowers", "grass"]
    assert (every["rounds"], flowers["rounds"], grass["rounds"]) == (3, 2, 1)
    assert flowers["gained"] == pytest.approx(0.25) and flowers["apart"] == pytest.approx(0.25)
    assert (flowers["covered"], grass["covered"]) == (0.5, 1) and grass["off"] is None
    assert flowers["share"] == pytest.approx(0.2) and flowers["off"] == pytest.approx(np.log(4) / 2**0.5)


def test_rounds_that_gain_nothing_count_for_the_interval_alone():
    curve = rounds([20.0, 21.0, 20.9])
    curve[2] |= {"closes": 1.0, "expected": 0.5, "expected_low": 0.2, "expected_high": 1.0}
    (every, _) = tables.check_predictions(curve)
    assert every["covered"] == 0 and every["share"] is every["off"] is None


def test_views_away_from_where_photos_may_be_taken_count_apart(tmp_path):
    group = {"psnr": 30.0, "psnr_colour_corrected": 31.0, "ssim": 0.9, "lpips": 0.1, "worst_decile": {"psnr": 29.0}}
    row = curves.read_cell(cell(tmp_path) | {"metrics": [metrics(tmp_path, 0, high=group, walker={"psnr": 10.0})]})[0]
    assert (row["psnr"], row["worst_psnr"], row["walker_psnr"]) == (30, 29, 10)


def test_a_job_without_a_benchmark_leaves_no_time(tmp_path):
    assert curves.read_cell(cell(tmp_path, times=[[str(tmp_path / "none.tsv")]]))[1]["seconds"] is None


def test_rows_survive_the_file(tmp_path):
    rows = rounds([20, 21, 22]) + rounds([19, 20, 21], seed=1)
    csv_tables.write_table(tmp_path / "curves.csv", rows)
    assert curves.read_curves(tmp_path / "curves.csv") == rows


def test_groups_of_scenes_are_compared_each_by_itself():
    some = [("oasis", 21, "mixed"), ("flowers", 23, "plants"), ("grass", 25, "plants")]
    cells = [rounds([20, 21, 22], scene=scene) for scene, _, _ in some]
    cells += [rounds([20, middle, 22], scene=scene, policy="w2") for scene, middle, _ in some]
    table = tables.summarise_cells([row for rows in cells for row in rows])
    found = tables.compare_groups(table, "farthest", {scene: group for scene, _, group in some} | {"moon": "empty"})
    psnr = {row["group"]: (row["mean"], row["units"]) for row in found if row["measure"] == "psnr"}
    assert psnr == {"mixed": (0.0, 1), "plants": (1.5, 2)}


def test_results_by_hand():
    (row,) = tables.summarise_cells(rounds([20, 22, 24]) + ALL)
    assert row["nauc"] == 22 and row["gap"] == 2 and row["photos"] == 16
    assert row["to_reach"] is None and row["seconds"] == 4 and row["evaluations"] == 30
    (near,) = tables.summarise_cells(rounds([20, 25, 25.8]) + ALL)
    assert near["to_reach"] == pytest.approx(12 + 4 * 0.7 / 0.8)
    (alone,) = tables.summarise_cells(rounds([20, 22, 24]))
    assert alone["gap"] is None and alone["to_reach"] is None


def test_all_photos_of_another_seed_are_no_goal():
    (row,) = tables.summarise_cells(rounds([20, 22, 24], seed=1) + ALL)
    assert row["gap"] is None


def test_policies_are_paired_with_the_baseline():
    both = [rounds([20, 21, 22], seed=s) + rounds([20, 21 + s, 22], seed=s, policy="w2") for s in range(3)]
    table = tables.summarise_cells([row for rows in both for row in rows])
    every, alone = compare(table, "farthest")
    assert every["scene"] == tables.EVERY and (alone["scene"], alone["k"]) == ("flowers", 4)
    assert every["units"] == 3 and every["mean"] == pytest.approx(0.5)
    assert (every["wins"], every["ties"], every["losses"]) == (2, 1, 0)
    assert every["holm"] == every["p"] and alone["holm"] is None


def test_one_cell_alone_has_no_interval():
    table = tables.summarise_cells(rounds([20, 21, 22]) + rounds([20, 22, 22], policy="w2"))
    for row in compare(table, "farthest"):
        assert row["mean"] == 0.5 and row["wins"] == 1
        assert row["low"] is row["high"] is row["p"] is row["holm"] is None


def test_cells_that_end_with_other_photos_or_start_elsewhere_are_not_paired():
    base = rounds([20, 21, 22])
    for other in (rounds([20, 21], (8, 12), policy="w2"), rounds([20, 21, 22], seed=1, policy="w2")):
        assert compare(tables.summarise_cells(base + other), "farthest") == []
    assert compare(tables.summarise_cells(rounds([20, 21, 22], policy="w2")), "farthest") == []


def test_settings_of_a_policy_are_policies_of_their_own():
    some = [rounds([20, 21, 22 + i], policy="w2-lpips", prior="terrain", lam=str(i)) for i in range(2)]
    compared = compare(tables.summarise_cells(rounds([20, 21, 22]) + some[0] + some[1]), "farthest")
    assert [(row["lam"], row["mean"]) for row in compared if row["scene"] == tables.EVERY] == [("0", 0), ("1", 0.25)]


def test_the_figure_is_whole_and_the_same_twice(tmp_path):
    table = rounds([20, 22, 24]) + rounds([20, 21, 22], policy="random") + rounds([20, 23, 25], policy="oracle") + ALL
    compared = compare(tables.summarise_cells(table), "farthest")
    for name in ("a.png", "b.png"):
        plots.write_figure(tmp_path / name, table, compared, "farthest")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_every_measure_is_compared_and_better_is_above_zero():
    both = rounds([20, 21, 22], seed=0) + rounds([20, 22, 22], seed=0, policy="w2")
    for row in both:
        better = row["policy"] == "w2" and row["round"] > 0
        row |= {"lpips": 0.1 if better else 0.2, "walker_psnr": 15.0 if better else 14.0}
    table = tables.summarise_cells(both)
    assert [row["nauc_lpips"] for row in table] == pytest.approx([0.2, 0.125])
    assert compare(table, "farthest", "lpips")[0]["mean"] == pytest.approx(0.075)
    assert compare(table, "farthest", "walker_psnr")[0]["mean"] == pytest.approx(0.75)
    assert compare(table, "farthest", "worst_psnr")[0]["mean"] == 0


def test_a_measure_that_a_round_lacks_is_not_compared():
    table = tables.summarise_cells(rounds([20, 21, 22]) + rounds([20, 22, 22], policy="w2"))
    assert compare(table, "farthest", "walker_psnr") == [] and table[0]["nauc_walker_psnr"] is None
