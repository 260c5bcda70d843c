"""Sweeps share what their cells have in common; one table, one figure; the study plans at every size."""

import csv
import shutil

import pytest
import yaml
from fixtures.runs import TINY, USUAL

from dav_gswt.images import image_files

FEW = """
study:
  sweeps:
    few:
      scenes: [desert]
      vary: {vary}
      fixed: {fixed}
      measure: {measure}
"""
SHARED = dict(render_photos=1, fit_coarse=1)


def few(folder, vary, fixed="{policy: w2, rounds: 1}", measure="{views: [0]}"):
    (path := folder / "few.yaml").write_text(FEW.format(vary=vary, fixed=fixed, measure=measure))
    return USUAL, TINY, path


@pytest.mark.parametrize(
    "vary, jobs",
    [
        pytest.param("{lam: [0, 1]}", dict(score_coarse=1, select_poses=2), id="lam shares the scores"),
        pytest.param("{p_drop: [0.05, 0.3]}", dict(score_coarse=2, update_field=2), id="p_drop does not"),
        pytest.param("{k: [2, 3, 4]}", dict(score_coarse=1, select_poses=3, update_field=3), id="k shares the scores"),
        pytest.param("{rounds: [0, 1, 2]}", dict(evaluate_coarse=1, update_field=2, score_round=1), id="T is a prefix"),
        pytest.param(
            "{policy: [w2, coverage-w2]}", dict(score_coarse=1, update_field=2), id="estimators share the scores"
        ),
        pytest.param("{policy: [random, all], rounds: [1, 2]}", dict(update_field=3), id="all photos are one round"),
    ],
)
def test_a_sweep_runs_shared_stages_once(planned, tmp_path, vary, jobs):
    fixed = "{policy: w2-lpips}" if "lam" in vary else "{policy: w2}" if "policy" not in vary else "{}"
    plan = planned(tmp_path, "results/sweeps/few.csv", configs=few(tmp_path, vary, fixed))
    wanted = jobs | SHARED | dict(gather_sweep=1, make_levels=0)
    assert {rule: plan[rule] for rule in wanted} == wanted


@pytest.mark.parametrize(
    "vary, jobs",
    [
        pytest.param("{tau: [0.3, 0.6, 0.9]}", dict(cut_tiles=1, bundle_tiles=3, measure_seams=3), id="tau"),
        pytest.param("{tiling: [semantic, colour]}", dict(make_levels=1, cut_tiles=2, measure_seams=2), id="seams"),
    ],
)
def test_what_is_varied_late_shares_the_reconstruction(planned, tmp_path, vary, jobs):
    configs = few(tmp_path, vary, measure="{tiles: [0], seams: [0]}")
    plan = planned(tmp_path, "results/sweeps/few.csv", configs=configs)
    wanted = jobs | SHARED | dict(update_field=1, score_round=1, evaluate_round=0)
    assert {rule: plan[rule] for rule in wanted} == wanted


def test_of_each_seed_only_what_is_asked_is_measured(planned, tmp_path):
    configs = few(tmp_path, "{k: [2, 4]}", measure="{views: [0, 1], tiles: [1], stills: [1]}")
    plan = planned(tmp_path, "results/sweeps/few.png", configs=configs)
    assert (plan["fit_coarse"], plan["evaluate_round"], plan["plot_sweep"]) == (2, 4, 1)
    assert plan["bundle_tiles"] == plan["render_terrain"] == 2 and not plan["measure_seams"]


@pytest.mark.parametrize("size", ["study.yaml", "paper.yaml"])
def test_the_page_of_results_plans(planned, root, tmp_path, size):
    """At `draft` and at the paper's size: every table and figure, each photo set and coarse field once.

    Of the first and the last scene and of two seeds: all of the paper's are thousands of jobs of the same kinds.
    """
    sweeps = yaml.safe_load((root / f"config/{size}").read_text())["study"]["sweeps"]
    scenes = [sweeps["k"]["scenes"][0], "copr_dunes_paper" if size == "paper.yaml" else sweeps["k"]["scenes"][-1]]
    few = {
        name: {"scenes": scenes, "measure": {what: of[:2] for what, of in sweep["measure"].items()}}
        for name, sweep in sweeps.items()
    }
    study = {"lod": {"scenes": scenes}, "sweeps": few}
    (trimmed := tmp_path / "trimmed.yaml").write_text(yaml.safe_dump({"study": study}))
    plan = plan_of(planned, root, tmp_path, "docs/research/results/results.md", f"config/{size}", trimmed)
    assert plan["fit_coarse"] == 2 * 2 and plan["render_photos"] + plan["register_photos"] == 2
    assert plan["gather_sweep"] == 7  # those that its tables are made from
    assert all(plan[f"tabulate_{table}"] == 1 for table in ("timing", "sensitivity", "ablation"))
    assert plan["plot_sphere"] == plan["plot_evolution"] == plan["plot_estimators"] == plan["plot_cuts"] == 2
    assert plan["write_results"] == plan["gather_lod"] == 1


def test_the_study_makes_every_page_and_each_photo_set_once(planned, root, tmp_path):
    plan = plan_of(planned, root, tmp_path, "study", "config/study.yaml")
    pages = ("write_results", "write_stability", "write_tradeoff")
    assert all(plan[page] == 1 for page in (*pages, "study"))
    assert plan["gather_sweep"] == plan["plot_sweep"] == 9
    asked = yaml.safe_load((root / "config/study.yaml").read_text())["study"]
    scenes = {*asked["sweeps"]["k"]["scenes"], asked["tradeoff"]["scene"]}
    assert plan["render_photos"] + plan["register_photos"] == len(scenes)


def plan_of(planned, root, tmp_path, target, *configs):
    """How often each rule runs for a target, from nothing."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "resources").symlink_to(root / "resources")
    return planned(folder, target, "--scheduler", "greedy", configs=(USUAL, *configs))


def test_a_finished_run_is_swept_without_making_anything_twice(snakemake, tiny, tmp_path):
    """tau over what is there: one bundle and its stills are new; a table, a figure, and what tables make of them."""
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    measure = "{views: [0], tiles: [0], stills: [0]}"
    configs = few(tmp_path, "{tau: [0.3, 0.6]}", "{policy: farthest}", measure)
    figures = "figures: {scenes: [desert], seed: 0, estimators: [w2], policy: farthest, rounds: 1}"
    study = f"  tables: {{timing: few, sensitivity: [few], ablation: [few], also: [], {figures}}}\n"
    configs[-1].write_text(configs[-1].read_text() + "      baseline: '0.6'\n" + study)
    tables = [f"results/tables/{name}.csv" for name in ("timing", "sensitivity", "ablation")]
    uncertainty = str(tiny.bundle.relative_to(tiny.folder) / "uncertainty.png")
    done = snakemake(folder, "--cores", "2", "results/sweeps/few.png", *tables, uncertainty, configs=configs)
    assert "8 of 8 steps (100%) done" in done.stdout  # bundle, stills, gather, plot, three tables, uncertainty
    with (folder / "results/sweeps/few.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["tau"], row["scene"], row["photos"]) for row in rows] == [(t, "desert", "7") for t in ("0.3", "0.6")]
    assert all(float(row[key]) > 0 for row in rows for key in ("psnr", "bundle_mb", "orders", "recon_s", "stills_s"))
    assert rows[0]["psnr"] == rows[1]["psnr"] and rows[0]["seam_lpips"] == ""
    kept = (folder / "docs/research/data/sweep_few.csv").read_text()
    assert kept.count("\n") == 3 and rows[0]["field"] in kept
    with (folder / "results/tables/sensitivity.csv").open(newline="") as file:
        assert [(row["value"], row["paper_psnr"]) for row in csv.DictReader(file)] == [
            ("0.3", "29.40±0.08"),
            ("0.6", "29.41±0.08"),
        ]
    for path in ("results/sweeps/few.png", uncertainty):
        assert image_files.read_size(folder / path)[0] > 600
