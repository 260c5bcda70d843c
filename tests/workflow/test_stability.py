"""The rules of stability: one job an extreme, and a run that fails is an outcome."""

import json

from dav_gswt.study.stability.extremes import EXTREMES


def test_every_extreme_is_a_job_of_its_own(planned, tmp_path):
    plan = planned(tmp_path, "stability")
    assert plan["run_extreme"] == len(EXTREMES)
    assert plan["measure_formulas"] == plan["gather_extremes"] == plan["write_stability"] == 1


def test_a_run_that_cannot_be_done_leaves_its_message(snakemake, tmp_path):
    snakemake(tmp_path, "--cores", "1", "results/stability/two-photos")
    found = json.loads((tmp_path / "results/stability/two-photos/outcome.json").read_text())
    assert found["exit_code"] == 1 and not found["traceback"]
    assert found["message"].startswith("config: scenes.desert.photos: input should be greater than or equal to 3")
