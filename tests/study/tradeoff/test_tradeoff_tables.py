"""What a setting lost to the most accurate, worked by hand; sentences say what the table says; figures of any table."""

import json

import numpy as np
import pytest
from fixtures.markdown import collapse_spaces

from dav_gswt.images import figures, image_files
from dav_gswt.study import csv_tables
from dav_gswt.study.tradeoff import page, plots, tables

SECONDS = dict(coarse=40.0, score=0.0, select=1.0, update=19.0, levels=5.0, cut=3.0, bundle=2.0)  # 70 in all
ORIGIN = {"version": "1", "renderer": {"backend": "cpu"}, "inputs": {"field": "f" * 64}}


def cell(folder, setting, psnr, faster=1.0, grey=0.5, measure="views", most=False, knob="cap", size=1.0, **more):
    (place := folder / f"{knob}-{setting}").mkdir(exist_ok=True)
    mean = {"psnr": psnr, "ssim": 0.5, "lpips": 1 - psnr / 100, "worst_decile": {"psnr": psnr}, "groups": {}}
    files = {"metrics.json": mean | {"photos": 12, "gaussians": 9, "provenance": ORIGIN}}
    chunk = {"count": 5, "bytes": int(250_000 * size), "orders": [0]}
    tile = {"uncertainty": 0.5, "chunks": [chunk]}
    files["davgswt.json"] = {"tiles": [tile], "levels": [{}], "directions": [0], "provenance": ORIGIN}
    files["fit.json"] = {"degree": 1, "steps": 300}
    for name, content in files.items():
        (place / name).write_text(json.dumps(content))
    image_files.write_png(place / "still.png", np.full((4, 6, 3), grey, np.float32))
    times = {}
    for job, seconds in SECONDS.items():
        (place / f"{job}.tsv").write_text(f"s\tmax_rss\n{seconds / faster}\t800.0\n")
        times[job] = [str(place / f"{job}.tsv")]
    wildcards = dict(
        scene="desert",
        seed=0,
        preset="q" if most else f"{knob}-{setting}",
        policy="farthest",
        prior="none",
        p_drop="0",
        lam="0",
        k=4,
    )
    wildcards |= dict(rounds=1, tiling="semantic", tau="0", sweep="tradeoff", samples=0, steps=0, corrected=False)
    files = {"metrics": str(place / "metrics.json"), "manifest": str(place / "davgswt.json")}
    about = {"knob": knob, "setting": setting, "measure": measure, "varied": {}, "times": times}
    about |= {"most": most, "base": most}
    stills = {"stills": [str(place / "still.png")], "fits": [str(place / "fit.json")] * 2, "files": files}
    return wildcards | about | stills | more


@pytest.fixture
def table(tmp_path):
    cells = [
        cell(tmp_path, "reference", 30.0, knob="preset", most=True),
        cell(tmp_path, "draft", 28.0, faster=2.0, knob="preset"),
        cell(tmp_path, "1000000", 30.0, most=True),
        cell(tmp_path, "70000", 29.8, faster=2.0),
        cell(tmp_path, "100", 29.0, faster=0.5),
        cell(tmp_path, "0", 30.0, knob="tau", measure="stills", most=True),
        cell(tmp_path, "1", 30.0, knob="tau", measure="stills", grey=0.6, faster=2.0, size=0.5),
    ]
    return tables.tabulate_settings(cells)


def test_seconds_are_those_of_all_jobs_or_of_those_on_tiles(table):
    by = {(row["knob"], row["setting"]): row for row in table}
    assert by["cap", "1000000"]["seconds"] == by["cap", "1000000"]["own_seconds"] == 70
    assert (by["tau", "1"]["seconds"], by["tau", "1"]["own_seconds"]) == (35, 5)
    assert by["cap", "70000"]["peak_mb"] == 800 and by["cap", "70000"]["bundle_mb"] == 0.25
    assert all(row["cores"] > 0 and row["processor"] for row in table)


def test_what_is_lost_is_counted_from_the_most_accurate_of_the_knob(table):
    by = {(row["knob"], row["setting"]): row for row in table}
    assert [by["cap", s]["loss"] for s in ("1000000", "70000", "100")] == pytest.approx([0, 0.2, 1.0])
    assert by["cap", "70000"]["loss_lpips"] == pytest.approx(0.002)
    assert by["tau", "0"]["loss"] == 0 and by["tau", "0"]["stills_psnr"] is None
    step = round(0.6 * 255) - round(0.5 * 255)  # PNGs hold whole levels
    assert by["tau", "1"]["loss"] == pytest.approx(step, abs=1)
    assert by["tau", "1"]["stills_psnr"] == pytest.approx(20 * np.log10(255 / step), abs=0.4)


def test_a_job_that_left_no_benchmark_leaves_the_seconds_empty(tmp_path):
    mine = cell(tmp_path, "1", 30.0, most=True)
    mine["times"]["levels"] = [str(tmp_path / "none.tsv")]
    (row,) = tables.tabulate_settings([mine])
    assert row["seconds"] is None and row["recon_s"] == 60 and tables.tabulate_front([row]) == []


def test_the_front_says_who_is_better_and_by_how_much(table):
    found = {(row["knob"], row["setting"]): row for row in tables.tabulate_front(table)}
    assert ("tau", "1") not in found
    assert ("cap", "1000000") not in found  # the cell of the preset: one point
    assert [found[key]["front"] for key in (("preset", "reference"), ("cap", "70000"), ("preset", "draft"))] == [
        1,
        1,
        0,
    ]
    draft = found["preset", "draft"]
    assert draft["behind"] == pytest.approx(1.8) and (draft["rival_knob"], draft["rival_setting"]) == ("cap", "70000")
    assert found["cap", "70000"]["behind"] == 0 and found["cap", "70000"]["rival_knob"] == ""


def test_a_setting_behind_in_psnr_can_be_the_sharpest(table):
    draft = next(row for row in table if row["setting"] == "draft")
    draft["lpips"] = 0.6  # the others: from .70 on
    found = {row["setting"]: (row["front"], row["sharp"]) for row in tables.tabulate_front(table)}
    assert found == {"reference": (1, 0), "draft": (0, 1), "70000": (1, 0), "100": (0, 0)}
    draft["lpips"] = None
    assert {row["sharp"] for row in tables.tabulate_front(table)} == {None}


def test_the_page_says_what_the_table_says(table, tmp_path):
    csv_tables.write_table(tmp_path / "t.csv", table)
    csv_tables.write_table(tmp_path / "p.csv", tables.tabulate_front(table))
    rows, pareto = tables.read_tradeoff(tmp_path / "t.csv"), tables.read_tradeoff(tmp_path / "p.csv")
    text = collapse_spaces(page.format_tradeoff(rows, pareto))
    assert "`cap` 70000 instead of 1000000: is 2.00 times as fast but costs 0.20 dB." in text
    assert "`cap` 100 instead of 1000000: takes 2.00 times as long and costs 1.00 dB." in text
    assert "costs 25.00 grey levels; the bundle is 0.50 times as large." in text
    assert "`draft` is not the best for its time: cap 70000 is as fast and 1.80 dB better." in text
    assert "`reference` is the best for its time" in text
    assert "| `draft` | 35 | 28.00 | 0.500 | 0.720 | 800 | 0.2 | no | no |" in text
    assert "| **1000000** | 70.0 |" in text and "| 70000 | 35.0 |" in text
    assert "None" not in text and "nan" not in text


@pytest.mark.parametrize(
    "own, loss, said",
    [
        (50.0, 0.2, "is 2.00 times as fast but costs 0.20 dB"),
        (50.0, -0.2, "is 2.00 times as fast and is better by 0.20 dB"),
        (200.0, -0.2, "takes 2.00 times as long but is better by 0.20 dB"),
        (101.0, 0.001, "is as fast and costs nothing"),
        (None, 0.2, "not measured"),
    ],
)
def test_advice_is_time_and_loss_in_words(own, loss, said):
    best = {"setting": "8", "own_seconds": 100.0, "bundle_mb": 1.0}
    row = {"knob": "cap", "setting": "4", "measure": "views", "own_seconds": own, "loss": loss, "bundle_mb": 1.0}
    assert page.describe_change(row, best) == f"`cap` 4 instead of 8: {said}."


def test_the_published_page_is_that_of_its_table(root):
    """Its knobs and every sentence about them, whatever the order of the rows."""
    rows = tables.read_tradeoff(root / "docs/research/data/tradeoff.csv")
    best = {row["knob"]: row for row in rows if row["most"]}
    told = (root / "docs/research/results/tradeoff.md").read_text(encoding="utf-8").splitlines()
    knobs = [knob for knob in best if knob != "preset"]
    assert sorted(line[4:] for line in told if line.startswith("### ")) == sorted(knobs)
    for row in rows:
        if row["knob"] != "preset" and not row["most"]:
            assert f"- {page.describe_change(row, best[row['knob']])}" in told


def test_where_a_setting_beats_the_most_accurate_it_is_said(tmp_path):
    cells = [cell(tmp_path, "2", 30.0, most=True), cell(tmp_path, "1", 30.5)]
    csv_tables.write_table(tmp_path / "t.csv", tables.tabulate_settings(cells))
    rows = tables.read_tradeoff(tmp_path / "t.csv")
    assert "`cap` 1 instead of 2: is as fast and is better by 0.50 dB." in page.format_tradeoff(
        rows, tables.tabulate_front(rows)
    )


def test_figures_are_drawn_of_what_is_known(table, tmp_path):
    table[3]["own_seconds"] = None
    figures.save_figure(plots.draw_knobs(table), tmp_path / "knobs.png")
    figures.save_figure(plots.draw_fronts(tables.tabulate_front(table)), tmp_path / "pareto.png")
    assert (
        image_files.read_size(tmp_path / "knobs.png")[0] > 600
        and image_files.read_size(tmp_path / "pareto.png")[0] > 600
    )
    figures.save_figure(
        plots.draw_fronts([row | {"sharp": None} for row in tables.tabulate_front(table)]), tmp_path / "one.png"
    )
    assert (
        image_files.read_size(tmp_path / "one.png")[0] < image_files.read_size(tmp_path / "pareto.png")[0]
    )  # a panel less
