"""Presets whose photos another preset's rounds choose: what is shared, and a run from those rounds to the page."""

import json
import shutil
from pathlib import Path

import yaml
from fixtures.configs import checked_config
from fixtures.runs import TINY, USUAL

from dav_gswt.cli.estimate import count_jobs
from dav_gswt.files import digest_files, read_json
from dav_gswt.inspect.result_files import find_scores
from dav_gswt.views import scores

CONFIGS = (USUAL, TINY)
SCORES = "scores_none_pdrop0/scores.csv"
ROUND = "results/desert/seed0/{preset}/active_farthest_none_pdrop0_lam0_k4/iter{t}"
BUNDLE = ROUND + "/tiles_semantic/bundle_tau0.6/davgswt.json"
SHORT = {"all", "convert_lpips_weights", "make_contact_sheet"}  # jobs that no estimate counts


def test_presets_share_the_rounds_of_the_one_that_chooses_for_them(planned, tmp_path):
    """And each round may be the last: its photos are fitted at once."""
    plan = planned(tmp_path, *(BUNDLE.format(preset=name, t=2) for name in ("draft", "standard", "reference")))
    assert plan["fit_coarse"] == plan["score_coarse"] == 1 and plan["select_poses"] == plan["update_field"] == 2
    assert plan["fit_chosen_photos"] == 2 and plan["copy_chosen_photos"] == 4 and plan["make_levels"] == 3
    assert planned(tmp_path, BUNDLE.format(preset="standard", t=1))["fit_chosen_photos"] == 1
    plan = planned(tmp_path, BUNDLE.format(preset="standard", t=0))
    assert plan["fit_coarse"] == plan["copy_coarse_field"] == 1 and not plan["fit_chosen_photos"]


def test_a_whole_run_fits_the_chosen_photos_once(planned, tmp_path):
    changed = {"scenes": {"desert": {"preset": "standard"}}}
    (tmp_path / "standard.json").write_text(json.dumps(changed))
    plan, counted = (
        planned(tmp_path, configs=(USUAL, tmp_path / "standard.json")),
        count_jobs(checked_config(), "standard"),
    )
    assert {rule: plan[rule] for rule in counted} == counted
    assert set(plan) - set(counted) == SHORT


def test_another_preset_fits_the_photos_that_the_first_one_chose(tiny, snakemake, planned, tmp_path):
    """The tiny run's rounds are its own: one fit to their photos, of another size, and what follows from it."""
    folder, config = tmp_path / "chosen", tmp_path / "finer.yaml"
    shutil.copytree(tiny.folder, folder)
    preset = {"size": 96, "spacing": 2.0, "max_gaussians": 9000, "steps": 40, "steps_per_photo": 10, "level_steps": 10}
    entries = {"presets": {"finer": preset | {"choose_with": "draft"}}, "scenes": {"desert": {"preset": "finer"}}}
    config.write_text(yaml.safe_dump(entries))
    configs = (*CONFIGS, config)
    plan = planned(folder, configs=configs)
    assert plan["copy_chosen_photos"] == plan["fit_chosen_photos"] == plan["evaluate_round"] == plan["score_round"] == 1
    assert not {"fit_coarse", "select_poses", "capture_views", "update_field", "evaluate_coarse"} & set(plan)

    own = tiny.round.relative_to(tiny.folder)
    made = Path(str(own).replace("/draft/", "/finer/"))
    page = made / tiny.terrain.relative_to(tiny.round) / "page"
    snakemake(folder, "--cores", "2", made / "metrics.json", made / "scores.csv", page, configs=configs)
    asked, chosen = (read_json(folder / path / "poses.json") for path in (own, made))
    assert chosen == asked | {"chosen_with": "draft"}
    taken = [digest_files(*sorted((folder / path / "capture").glob("[!.]*"))) for path in (own, made)]
    assert taken[0] == taken[1]
    found = read_json(folder / made / "metrics.json")
    assert (
        found["photos"] == 7 and 20 < found["psnr"] < 60 and found["provenance"]["parameters"]["choose_with"] == "draft"
    )
    assert find_scores(folder / made / "poses.json") == folder / tiny.coarse.relative_to(tiny.folder) / SCORES
    assert scores.read_scores(folder / made / "scores.csv").scales == scores.read_scores(tiny.coarse / SCORES).scales
    rounds = read_json(folder / page / "story.json")["rounds"]
    assert [one.get("preset") for one in rounds] == ["draft", None] and rounds[1]["psnr"] == round(found["psnr"], 2)
