import json
import re

import numpy as np
import pytest

from dav_gswt_study import sweeps
from dav_gswt_study.claims import PAGE, TEMPLATE, Difference, describe_claims
from dav_gswt_study.markdown import render_template
from dav_gswt_study.tables import paper, spread

ROW = dict.fromkeys(sweeps.list_columns(1)) | {"preset": "draft", "tiling": "semantic", "tau": "0.6"}
TWO = [("desert", 0, 30.0), ("desert", 1, 32.0), ("dunes", 0, 20.0), ("dunes", 1, 21.0)]


def cell(value, scene="desert", seed=0, **measured):
    return ROW | {"varied_0": value, "scene": scene, "seed": str(seed)} | measured


def test_means_count_scenes_alike_and_deviations_are_over_seeds():
    rows = [cell("a", scene, seed, psnr=p) for scene, seed, p in TWO]
    deviation = pytest.approx(np.std([25, 26.5], ddof=1))
    assert spread.mean_and_deviation(rows, "psnr") == {"psnr": pytest.approx(25.75), "psnr_sd": deviation}
    assert spread.mean_and_deviation(rows[:1], "psnr") == {"psnr": 30, "psnr_sd": None}
    assert spread.mean_and_deviation([cell("a")], "psnr") == {"psnr": None, "psnr_sd": None}
    lacking = [*rows, cell("a", "desert", 2, psnr=99.0)]  # a seed that one scene lacks is no seed of all
    assert spread.mean_and_deviation(lacking, "psnr")["psnr_sd"] == deviation


def test_variants_are_compared_in_pairs_with_the_baseline_of_their_sweep_in_the_last_round():
    base = [cell("w2-lpips", scene, seed, psnr=p) for scene, seed, p in TWO]
    mine = [cell("w2", scene, seed, psnr=p + d) for (scene, seed, p), d in zip(TWO, (0.1, 0.2, 0.4, 0.5), strict=True)]
    alone = [cell("single", "desert", 0, psnr=29.0)]
    full, w2, single = paper.tabulate_ablation({"estimators": base + mine + alone}, {"estimators": "w2-lpips"})
    assert full["psnr_difference"] is None and full["paper_memory_gb"] == "6.2±0.1"
    assert w2["psnr_difference"] == pytest.approx(0.3) and (w2["psnr_units"], w2["psnr_df"]) == (4, 2)
    s = np.sqrt((0.005 + 0.005) / 2)
    assert w2["psnr_t"] == pytest.approx(0.3 / (s / 2)) and w2["psnr_p"] < 0.05 and w2["psnr_holm"] == w2["psnr_p"]
    assert (single["psnr_difference"], single["psnr_df"], single["psnr_p"]) == (pytest.approx(-1), 0, None)
    assert w2["seam_lpips_difference"] is None
    rows = [cell(v, psnr=20.0 + t + (v == "all"), varied_1=str(t)) for v in ("random", "all") for t in (0, 1, 2)]
    rows = [row for row in rows if (row["varied_0"], row["varied_1"]) != ("all", "2")]  # all are taken in one round
    random, everything = paper.tabulate_ablation({"budget": rows}, {"budget": "random"})
    assert (random["psnr"], everything["psnr"], everything["psnr_difference"]) == (22, 22, 0)


def test_every_value_is_printed_in_the_papers_table(root):
    """tests/golden/paper_tables.json: the numbers of the paper's tables, and of the protocol in its text."""
    printed = json.loads((root / "tests/golden/paper_tables.json").read_text(encoding="utf-8"))
    for where, value in paper.read_paper().items():
        assert set(re.findall(r"\d+(?:\.\d+)?", value)) <= set(printed[where[0]]), where
    assert paper.find_printed("ablation", "w2", ("psnr", "p")) == {"paper_psnr": "29.12±0.09", "paper_p": "0.006"}
    assert paper.find_printed("timing", "copr_dunes", ("cut_s",)) == {"paper_cut_s": None}


def test_the_page_has_the_figures_of_the_tables(root):
    assert (root / PAGE).read_text() == render_template(root / TEMPLATE, describe_claims(root)), "run `make claims`"


def test_an_interval_and_a_test_decide_whether_a_claim_holds():
    for difference, word in (
        (Difference(0.1, 0.1, 0.3), "holds"),
        (Difference(0.1, 0.0, 0.3), "not shown"),
        (Difference(0.1, -0.3, -0.1), "contradicted"),
        (Difference(-0.2), "by the means, no"),
        (Difference(0.1, -0.3, -0.1, pairs=2), "in neither of 2 scenes"),
        (Difference(0.4, 0.1, 0.9, pairs=6, p=0.35), "not shown"),
    ):
        assert difference.judge() == word
    assert Difference(0.2, -0.1, 0.5).reverse() == Difference(-0.2, -0.5, 0.1)
