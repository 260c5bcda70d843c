import json
from functools import partial

import pytest

from dav_gswt_study.comparison import curves, tables

CELL = dict(scene="flowers", seed=0, preset="draft", policy="farthest", prior="none", p_drop="0", lam="0", k=4)


def rounds(psnr, photos=(8, 12, 16), **cell):
    rest = {"ssim": 0.8, "lpips": None, "worst_psnr": 20.0, "walker_psnr": None, "seconds": 2.0}
    about = {"version": "1", "renderer": "cpu", "field": "f"}
    return [
        CELL | cell | {"round": t, "photos": n, "psnr": float(p)} | rest | about
        for t, (n, p) in enumerate(zip(photos, psnr, strict=True))
    ]


ALL = rounds([20, 26], (8, 48), policy="all")


@pytest.fixture(autouse=True)
def few_replicates(monkeypatch):
    monkeypatch.setattr(tables, "bootstrap_paired", partial(tables.bootstrap_paired, replicates=200))


def compare(rows, measure="psnr"):
    found = tables.compare_to_baseline(tables.summarise_cells(rows), "farthest")
    return [row for row in found if row["measure"] == measure]


def metrics(folder, t, **groups):
    mean = {"psnr": 20.0 + t, "psnr_colour_corrected": 21.0 + t, "ssim": 0.5, "lpips": 0.25}
    metrics = mean | {"worst_decile": mean, "groups": groups, "photos": 8 + 4 * t}
    metrics |= {"provenance": {"version": "0.1", "renderer": {"backend": "cpu"}, "inputs": {"field": 64 * "a"}}}
    (path := folder / f"metrics{t}.json").write_text(json.dumps(metrics))
    return str(path)


def cell(folder, rounds=2, **given):
    (time := folder / "job.tsv").write_text("s\th:m:s\n1.5\t0:00:01\n")
    files = {"times": [[str(time), str(time)]] * (rounds - 1)}
    files |= {"metrics": [metrics(folder, t) for t in range(rounds)]}
    return CELL | {"corrected": False} | files | given


def test_a_row_a_round_with_what_it_cost(tmp_path):
    start, first = curves.read_cell(cell(tmp_path))
    assert (start["round"], start["photos"], start["psnr"], start["seconds"]) == (0, 8, 20, 0)
    assert (first["round"], first["photos"], first["psnr"], first["seconds"]) == (1, 12, 21, 3)
    assert first["field"] == 12 * "a"
    other = curves.read_cell(cell(tmp_path, corrected=True, times=[[str(tmp_path / "none.tsv")]]))
    assert other[0]["psnr"] == 21 and other[1]["seconds"] is None
    group = {"psnr": 30.0, "ssim": 0.9, "lpips": 0.1, "worst_decile": {"psnr": 29.0}}
    apart = cell(tmp_path) | {"metrics": [metrics(tmp_path, 0, high=group, walker={"psnr": 10.0})]}
    row = curves.read_cell(apart)[0]  # views away from where photos may be taken count apart
    assert (row["psnr"], row["worst_psnr"], row["walker_psnr"]) == (30, 29, 10)


def test_results_by_hand():
    (row,) = tables.summarise_cells(rounds([20, 22, 24]) + ALL)
    assert row["nauc"] == 22 and row["gap"] == 2 and row["photos"] == 16
    assert row["seconds"] == 4
    for goal in ([], rounds([20, 26], (8, 48), policy="all", seed=1)):  # of another seed it is none
        (alone,) = tables.summarise_cells(rounds([20, 22, 24]) + goal)
        assert alone["gap"] is None


def test_policies_are_paired_with_the_baseline():
    both = [rounds([20, 21, 22], seed=s) + rounds([20, 21 + s, 22], seed=s, policy="w2") for s in range(3)]
    every, alone = compare([row for rows in both for row in rows])
    assert every["scene"] == tables.EVERY and (alone["scene"], alone["k"]) == ("flowers", 4)
    assert every["units"] == 3 and every["mean"] == pytest.approx(0.5)
    assert (every["wins"], every["ties"], every["losses"]) == (2, 1, 0)
    for row in compare(both[1]):  # one cell alone has no interval
        assert row["mean"] == 0.5 and row["wins"] == 1
        assert row["low"] is row["high"] is None
    base = rounds([20, 21, 22])  # cells that end with other photos or start elsewhere are not paired
    for other in (rounds([20, 21], (8, 12), policy="w2"), rounds([20, 21, 22], seed=1, policy="w2")):
        assert compare(base + other) == []
    assert compare(rounds([20, 21, 22], policy="w2")) == []


def test_every_measure_is_compared_by_groups_of_scenes_and_better_is_above_zero():
    groups = {"oasis": "mixed", "flowers": "plants", "grass": "plants", "moon": "empty"}
    rows = []
    for scene, middle in (("oasis", 21), ("flowers", 23), ("grass", 25)):
        rows += rounds([20, 21, 22], scene=scene) + rounds([20, middle, 22], scene=scene, policy="w2")
    for row in rows:
        better = row["policy"] == "w2" and row["round"] > 0
        row |= {"lpips": 0.1 if better else 0.2}
        row |= {"walker_psnr": 15.0 if better else 14.0} if row["scene"] == "grass" else {}
    table = tables.summarise_cells(rows)
    assert [row["nauc_lpips"] for row in table] == pytest.approx(3 * [0.2, 0.125])
    found = tables.compare_to_baseline(table, "farthest")
    means = {row["measure"]: row["mean"] for row in found if row["scene"] == tables.EVERY}
    assert means == pytest.approx({"psnr": 1, "lpips": 0.075, "walker_psnr": 0.75, "worst_psnr": 0})
    found = tables.compare_groups(table, "farthest", groups)
    psnr = {row["group"]: (row["mean"], row["units"]) for row in found if row["measure"] == "psnr"}
    assert psnr == {"mixed": (0.0, 1), "plants": (1.5, 2)}
