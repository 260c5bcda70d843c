import json

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dav_gswt.images import image_files
from dav_gswt_study.tradeoff import tables

SECONDS = dict(coarse=40.0, score=0.0, select=1.0, update=19.0, levels=5.0, cut=3.0, bundle=2.0)  # 70 in all
ORIGIN = {"version": "1", "renderer": {"backend": "cpu"}, "inputs": {"field": "f" * 64}}


def cell(folder, setting, psnr, faster=1.0, grey=0.5, measure="views", most=False, knob="cap"):
    (place := folder / f"{knob}-{setting}").mkdir(exist_ok=True)
    mean = {"psnr": psnr, "ssim": 0.5, "lpips": 1 - psnr / 100, "worst_decile": {"psnr": psnr}, "groups": {}}
    files = {"metrics.json": mean | {"photos": 12, "gaussians": 9, "provenance": ORIGIN}}
    tile = {"uncertainty": 0.5, "orders": [0], "chunks": [{"count": 5}]}
    files["davgswt.json"] = {"tiles": [tile], "levels": [{}], "directions": [0], "provenance": ORIGIN}
    files["davgswt.json"]["parts"] = [{"bytes": 250_000}]
    for name, content in files.items():
        (place / name).write_text(json.dumps(content))
    image_files.write_png(place / "still.png", np.full((4, 6, 3), grey, np.float32))
    times = {}
    for job, seconds in SECONDS.items():
        (place / f"{job}.tsv").write_text(f"s\tmax_rss\n{seconds / faster}\t800.0\n")
        times[job] = [str(place / f"{job}.tsv")]
    preset = "q" if most else f"{knob}-{setting}"
    made = dict(scene="desert", seed=0, preset=preset, policy="farthest", prior="none", p_drop="0", lam="0", k=4)
    made |= dict(rounds=1, tiling="semantic", tau="0", sweep="tradeoff", samples=0, steps=0, corrected=False)
    files = {"metrics": str(place / "metrics.json"), "manifest": str(place / "davgswt.json")}
    about = {"knob": knob, "setting": setting, "measure": measure, "varied": {}, "times": times, "files": files}
    return made | about | {"most": most, "base": most, "stills": [str(place / "still.png")]}


@pytest.fixture
def table(tmp_path):
    cells = [
        cell(tmp_path, "reference", 30.0, knob="preset", most=True),
        cell(tmp_path, "draft", 28.0, faster=2.0, knob="preset"),
        cell(tmp_path, "1000000", 30.0, most=True),
        cell(tmp_path, "70000", 29.8, faster=2.0),
        cell(tmp_path, "100", 29.0, faster=0.5),
        cell(tmp_path, "0", 30.0, knob="tau", measure="stills", most=True),
        cell(tmp_path, "1", 30.0, knob="tau", measure="stills", grey=0.6, faster=2.0),
    ]
    return tables.tabulate_settings(cells)


def test_seconds_are_those_of_all_jobs_or_of_those_on_tiles_and_losses_those_to_the_most_accurate(table):
    by = {(row["knob"], row["setting"]): row for row in table}
    assert by["cap", "1000000"]["seconds"] == by["cap", "1000000"]["own_seconds"] == 70
    assert (by["tau", "1"]["seconds"], by["tau", "1"]["own_seconds"]) == (35, 5)
    assert by["cap", "70000"]["peak_mb"] == 800 and by["cap", "70000"]["bundle_mb"] == 0.25
    assert [by["cap", s]["loss"] for s in ("1000000", "70000", "100")] == pytest.approx([0, 0.2, 1.0])
    assert by["cap", "70000"]["loss_lpips"] == pytest.approx(0.002)
    assert by["tau", "0"]["loss"] == 0 and by["tau", "0"]["stills_psnr"] is None
    step = round(0.6 * 255) - round(0.5 * 255)  # PNGs hold whole levels
    assert by["tau", "1"]["loss"] == pytest.approx(step, abs=1)
    assert by["tau", "1"]["stills_psnr"] == pytest.approx(20 * np.log10(255 / step), abs=0.4)


def test_the_front_says_who_is_better_and_by_how_much(table):
    found = {(row["knob"], row["setting"]): row for row in tables.tabulate_front(table)}
    assert ("tau", "1") not in found
    assert ("cap", "1000000") not in found  # the cell of the preset: one point
    assert found["preset", "reference"]["front"] == found["cap", "70000"]["front"] == 1
    draft = found["preset", "draft"]
    assert (draft["front"], draft["rival_knob"], draft["rival_setting"]) == (0, "cap", "70000")
    assert draft["behind"] == pytest.approx(1.8)
    assert found["cap", "70000"]["behind"] == 0 and found["cap", "70000"]["rival_knob"] == ""


def test_a_setting_behind_in_psnr_can_be_the_sharpest(table):
    draft = next(row for row in table if row["setting"] == "draft")
    draft["lpips"] = 0.6  # the others: from .70 on
    found = {row["setting"]: (row["front"], row["sharp"]) for row in tables.tabulate_front(table)}
    assert found == {"reference": (1, 0), "draft": (0, 1), "70000": (1, 0), "100": (0, 0)}
    draft["lpips"] = None
    assert {row["sharp"] for row in tables.tabulate_front(table)} == {None}


few = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12)  # ties are common


@given(few)
@example([(1, 1), (1, 1)])
@example([(1, 1), (1, 2)])
@example([(2, 2), (1, 2)])
def test_the_front_is_that_of_all_pairs_and_a_rival_is_the_best_that_is_affordable(points):
    cost, worth = np.array(points, float).T
    expected = [not any(c <= a and w >= b and (c, w) != (a, b) for c, w in points) for a, b in points]
    assert tables.find_pareto_front(cost, worth).tolist() == expected
    for i, rival in enumerate(tables.find_rivals(cost, worth)):
        assert cost[rival] <= cost[i]
        assert worth[rival] == max(w for c, w in points if c <= cost[i])
        assert rival == i or worth[rival] > worth[i]
    assert tables.find_pareto_front(np.zeros(0), np.zeros(0)).size == 0
