"""Plans of the study: every documented target can be planned, and what experiments share is planned once."""

import pytest
import yaml
from fixtures import doc_pages
from fixtures.runs import TINY, USUAL

from dav_gswt_study.stability.extremes import EXTREMES


def test_every_documented_target_is_planned(planned, root, tmp_path):
    targets = doc_pages.named_targets(root / "study/README.md")["snakemake"] - {"study/Snakefile"}
    assert {"study", "seams", "tradeoff", "view_benchmark", "frame_times", "presort_table"} <= targets
    assert planned(tmp_path, *sorted(targets))["fit_coarse"]


@pytest.mark.parametrize(
    "vary, jobs",
    [
        pytest.param({"lam": [0, 1]}, dict(score_coarse=1, select_poses=2), id="lam shares the scores"),
        pytest.param({"p_drop": [0.05, 0.3]}, dict(score_coarse=2, update_field=2), id="p_drop does not"),
        pytest.param({"rounds": [0, 1, 2]}, dict(update_field=2, score_round=1), id="rounds share their prefix"),
    ],
)
def test_a_sweep_runs_shared_stages_once(planned, tmp_path, vary, jobs):
    fixed = {"policy": "w2-lpips"} if "lam" in vary else {"policy": "w2"}
    fixed |= {} if "rounds" in vary else {"rounds": 1}
    sweep = {"scenes": ["desert"], "vary": vary, "fixed": fixed, "measure": {"views": [0]}}
    (tmp_path / "few.yaml").write_text(yaml.safe_dump({"study": {"sweeps": {"few": sweep}}}))
    plan = planned(tmp_path, "study/results/sweeps/few.csv", configs=(USUAL, TINY, tmp_path / "few.yaml"))
    wanted = jobs | dict(render_photos=1, fit_coarse=1, gather_comparison=1, make_levels=0)
    assert {rule: plan[rule] for rule in wanted} == wanted


EXPERIMENTS = {  # target: settings of the study, jobs
    "stability": ({}, dict(run_extreme=len(EXTREMES), measure_formulas=1, write_stability=1)),
    "calibration": (
        {"calibration": {"scenes": ["desert_pool", "planet_pool"], "rounds": 2}},
        dict(calibrate_coarse=2, calibrate_round=4, plot_calibration=1),
    ),
    "seams": (  # two ways to cut, of the same levels
        {
            "seams": {
                "scenes": ["desert"],
                "tilings": ["colour", "semantic"],
                "baseline": "colour",
                "replicates": 1,
                "compared_replicates": 1,
            }
        },
        dict(make_levels=1, cut_tiles=2, measure_seams=2, plot_cuts=1, gather_seams=1),
    ),
    "perceptual_kit": (  # tiles that are in two pairs are cut once; `floor` cuts nothing
        {"forced_choice": {"scenes": ["desert"], "pairs": [["semantic", "colour"], ["semantic", "floor"]]}},
        dict(render_pairs=1, make_levels=1, cut_tiles=2, make_kit=1, evaluate_answers=0),
    ),
    "view_benchmark": (  # all photos are one round, whatever k is
        {
            "view_benchmark": {
                "policies": ["farthest", "random", "all"],
                "seeds": [0, 1],
                "sets": [{"title": "pools", "scenes": ["desert_pool"], "k": [4, 6], "photos": 20}],
            }
        },
        dict(
            render_study_photos=1, fit_coarse=2, score_coarse=2, update_field=2 * (2 * (3 + 2) + 1), compare_policies=1
        ),
    ),
}


@pytest.mark.parametrize("target", EXPERIMENTS)
def test_an_experiment_plans_what_its_cells_share_once(planned, tmp_path, target):
    study, wanted = EXPERIMENTS[target]
    (tmp_path / "few.yaml").write_text(yaml.safe_dump({"study": study}))
    tiny = [TINY] if target == "seams" else []
    plan = planned(tmp_path, target, configs=(USUAL, *tiny, tmp_path / "few.yaml"))
    assert {rule: plan[rule] for rule in wanted} == wanted
