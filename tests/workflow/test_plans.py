"""What a sweep recomputes: the stages below the parameter it varies, and no others."""

import os
import re
import time
from collections import Counter

import pytest
from fixtures.configs import checked_config
from fixtures.runs import TINY, USUAL

from dav_gswt.cli.estimate import count_jobs
from dav_gswt.views.policy_names import ORACLES, POLICY_NAMES, PRIOR_POLICIES, ZERO_SETTINGS

ROUND = "results/desert/seed0/draft/active_{policy}_none_pdrop0_lam0_k{k}/iter{t}"
BUNDLE = ROUND + "/tiles_semantic/bundle_tau{tau}/davgswt.json"
DEFAULT = dict(policy="farthest", k=4, t=2, tau=0.6)
FARTHEST = ROUND.format(policy="farthest", k=4, t=1)
GIVEN = "results/finished/seed0/draft/active_external_none_pdrop0_lam0_k0/iter0"
LAM = ROUND.format(policy="farthest", k=4, t=1).replace("lam0", "lam0.1")


SHARED = dict(fit_coarse=1, score_coarse=1)


@pytest.mark.parametrize(
    "axis, values, jobs",
    [
        pytest.param("tau", (0.3, 0.6), dict(update_field=2, cut_tiles=1, bundle_tiles=2), id="tau shares the tiles"),
        pytest.param("k", (2, 4), dict(update_field=4, bundle_tiles=2), id="k shares the scored coarse field"),
        pytest.param("policy", ("farthest", "random"), dict(update_field=4), id="policies share it too"),
        pytest.param("t", (1, 2), dict(update_field=2, cut_tiles=2), id="rounds share their prefix"),
    ],
)
def test_shared_stages_are_planned_once(planned, tmp_path, axis, values, jobs):
    targets = [BUNDLE.format(**(DEFAULT | {axis: value})) for value in values]
    plan = planned(tmp_path, *targets)
    assert {rule: plan[rule] for rule in jobs | SHARED} == jobs | SHARED


def test_the_default_target_makes_every_stage_once(planned, tmp_path):
    plan = planned(tmp_path)
    once = ["render_photos", "split_views", "fit_coarse", "score_coarse", "make_levels", "cut_tiles", "bundle_tiles"]
    assert all(plan[rule] == 1 for rule in [*once, "make_page", "render_terrain"])
    assert plan["update_field"] == plan["capture_views"] == 2
    assert plan["evaluate_coarse"] == 1 and plan["evaluate_round"] == 2


ASKED = "results/desert/seed0/draft/active_w2-lpips_terrain_pdrop{p_drop}_lam{lam}_k4/iter2/metrics.json"


@pytest.mark.parametrize(
    "axis, values, scorings",
    [
        pytest.param("lam", ("0", "0.1", "1"), 1, id="lam shares the scores"),
        pytest.param("p_drop", ("0.05", "0.3"), 2, id="p_drop does not"),
    ],
)
def test_a_prior_is_asked_once_for_every_lam(planned, tmp_path, axis, values, scorings):
    targets = [ASKED.format(**({"lam": "0.1", "p_drop": "0.15"} | {axis: value})) for value in values]
    plan = planned(tmp_path, *targets)
    assert plan["score_coarse"] == scorings and plan["fit_coarse"] == 1
    assert plan["select_poses"] == plan["update_field"] == 2 * len(values) and plan["convert_lpips_weights"] == 1


def test_scores_are_judged_by_truth_that_is_drawn_once_a_scene(planned, tmp_path):
    (tmp_path / "few.yaml").write_text("study: {calibration: {scenes: [desert, planet], rounds: 2}}")
    plan = planned(tmp_path, "calibration", configs=(USUAL, tmp_path / "few.yaml"))
    assert plan["render_candidates"] == plan["calibrate_coarse"] == 2 and plan["calibrate_round"] == 4
    assert plan["plot_calibration"] == 1


SHORT = {"all", "convert_lpips_weights", "make_contact_sheet"}  # jobs that no estimate counts


def test_the_estimate_counts_the_jobs_of_a_run(planned, tmp_path):
    plan, counted = planned(tmp_path), count_jobs(checked_config())
    assert {rule: plan[rule] for rule in counted} == counted
    assert set(plan) - set(counted) == SHORT


def test_policies_share_what_they_start_from(planned, tmp_path):
    """Two scenes of three seeds; all photos are one round, whatever k is."""
    (tmp_path / "few.yaml").write_text(
        "study: {view_benchmark: {policies: [farthest, random, all], seeds: [0, 1, 2], sets: "
        "[{title: pools, scenes: [desert_pool, grass_pool], k: [4, 6], photos: 20}]}}"
    )
    plan = planned(tmp_path, "view_benchmark", configs=(USUAL, tmp_path / "few.yaml"))
    assert plan["render_photos"] == 2 and plan["fit_coarse"] == plan["score_coarse"] == 6
    assert plan["update_field"] == plan["evaluate_round"] == 6 * (2 * (3 + 2) + 1)
    assert plan["score_round"] == 6 * 2 * (2 + 1) and plan["compare_policies"] == plan["gather_curves"] == 1


def test_every_policy_has_a_path(planned, tmp_path):
    for policy in POLICY_NAMES:
        spelled = {"prior": "none", "p_drop": "0", "lam": "0"}
        if policy in PRIOR_POLICIES:
            spelled = {"prior": "terrain", "p_drop": "0.15", "lam": "0.1"} | dict.fromkeys(
                ZERO_SETTINGS.get(policy, ()), "0"
            )
        way = "{}_{prior}_pdrop{p_drop}_lam{lam}".format(policy, **spelled)
        plan = planned(tmp_path, f"results/desert/seed0/draft/active_{way}_k4/iter1/field.ply")
        assert plan["update_field"] == plan["select_poses"] == 1, policy
        assert plan["render_candidates"] == (policy in ORACLES)
        assert plan["convert_lpips_weights"] == (policy in PRIOR_POLICIES)


@pytest.mark.parametrize("t", [0, 1, 2])
def test_a_round_s_photos_leave_with_those_of_the_rounds_before(planned, tmp_path, t):
    plan = planned(tmp_path, ROUND.format(policy="farthest", k=4, t=t) + "/exports/model")
    assert plan["export_model"] == 1 and plan["capture_views"] == plan["update_field"] == t
    assert plan["render_photos"] == plan["split_views"] == 1 and "make_levels" not in plan


@pytest.mark.parametrize("policy", ["farthest", "coverage-error", "oracle", "w2-lpips", "single"])
def test_the_default_target_takes_a_policy_of_every_kind(planned, tmp_path, policy):
    default = planned(tmp_path, "--config", f"policy={policy}", configs=(USUAL, TINY))
    assert default["make_page"] == 1 and default["select_poses"] == 1


STOP = "results/desert/seed0/draft/active_farthest_none_pdrop0_lam0_k4{}/iter3/metrics.json"


def test_every_stop_has_a_branch_of_its_own_and_all_share_the_coarse_field(planned, tmp_path):
    stops = ["", "_upto20", "_gain0.05", "_upto20_gain0.05"]
    plan = planned(tmp_path, *map(STOP.format, stops))
    assert plan["fit_coarse"] == plan["score_coarse"] == 1
    assert plan["select_poses"] == plan["capture_views"] == plan["update_field"] == 3 * len(stops)
    (tmp_path / "stop.yaml").write_text("stop: {marginal_gain: 0.050, photos: 20}")
    default = planned(tmp_path, configs=(USUAL, TINY, tmp_path / "stop.yaml"))
    assert default["select_poses"] == default["make_page"] == 1


def test_the_oracle_needs_a_scene_whose_truth_is_known(snakemake, photo_sets, tmp_path):
    path = "results/copr_dunes/seed0/standard/active_oracle_none_pdrop0_lam0_k4/iter1/poses.json"
    config = tmp_path / "there.yaml"
    for agent, known in (("replay", True), ("plan", False)):
        config.write_text(f"scenes: {{copr_dunes: {{folder: {photo_sets}/copr_dunes/images, agent: {agent}}}}}")
        done = snakemake(tmp_path, path, "--dry-run", configs=(USUAL, config), check=False)
        assert (done.returncode == 0) == known
        assert known or "policy oracle: what copr_dunes truly shows is not known" in done.stdout


TARGETS = ("all", "seams", "study", "lod_table")


def tiling_jobs(output: str) -> dict[str, str]:
    """Of each planned cut its input and its parameters, by the folder of the tiles. output: of a dry run with -p."""
    jobs = [job for job in re.split(r"\n(?=(?:local)?rule )", output) if job.startswith("rule cut_tiles:")]
    return {re.search(r"output: (\S+)/seams\.json", job)[1]: re.search(r"input: (.*)", job)[1] for job in jobs}


def test_every_target_plans_the_same_tiles_of_a_scene(snakemake, tmp_path):
    """What tiles are cut from follows from the config alone, whatever is asked for and whatever is on disk."""
    study = "study: {seams: {scenes: [desert], tilings: [semantic], baseline: semantic, replicates: 1}, "
    study += "lod: {scenes: [desert], fixed: {policy: farthest}}, tables: {figures: {scenes: [desert]}}}"
    (tmp_path / "few.yaml").write_text(study + "\nlpips: installed\n")
    configs = (USUAL, TINY, tmp_path / "few.yaml")
    plans = [tiling_jobs(snakemake(tmp_path, target, "--dry-run", configs=configs).stdout) for target in TARGETS]
    default = plans[0]
    assert len(default) == 1
    assert all(plan.items() >= default.items() for plan in plans)
    assert all("lpips_alexnet.safetensors" in inputs for inputs in default.values())
    weights = tmp_path / "results/weights/lpips_alexnet.safetensors"
    weights.parent.mkdir(parents=True)
    weights.touch()
    assert tiling_jobs(snakemake(tmp_path, "all", "--dry-run", configs=configs).stdout) == default


@pytest.mark.parametrize("target", ["all", "seams"])
def test_without_lpips_no_target_plans_its_weights(planned, tmp_path, target):
    (tmp_path / "few.yaml").write_text(
        "lpips: none\nstudy: {seams: {scenes: [desert], tilings: [semantic], baseline: semantic}}"
    )
    assert not planned(tmp_path, target, configs=(USUAL, TINY, tmp_path / "few.yaml"))["convert_lpips_weights"]


def test_tiles_go_by_the_uncertainty_of_the_prior_that_was_asked(planned, tmp_path):
    plan = planned(tmp_path, "--config", "policy=w2-lpips", configs=(USUAL, TINY))
    assert plan["score_coarse"] == plan["score_round"] == plan["make_levels"] == 1
    tiles = "results/desert/seed0/draft/active_{}_k4/iter0/tiles_semantic/seams.json"
    for way, scored in (("w2-lpips_terrain_pdrop0.15_lam0", 1), ("random_none_pdrop0_lam0", 0)):
        assert planned(tmp_path, tiles.format(way))["score_coarse"] == scored


@pytest.mark.parametrize("suffix, rule", [("-refined", "refine_tiles"), ("-expansion", "cut_tiles_by_expansion")])
def test_tiles_of_the_study_go_on_as_the_others_do(planned, tmp_path, suffix, rule):
    cut = ROUND.format(policy="farthest", k=4, t=1) + "/{}/bundle_tau0.6/davgswt.json"
    plan = planned(tmp_path, cut.format(f"tiles_semantic{suffix}"), cut.format("tiles_semantic"))
    assert plan["cut_tiles"] == plan[rule] == 1
    assert plan["bundle_tiles"] == 2


def test_a_refinement_needs_the_weights_of_its_prior(snakemake, tmp_path):
    (tmp_path / "other.yaml").write_text(
        "study: {refine: {prior: mine}}\n"
        "priors: {mine: {model: terrain, samples: 2, steps: 2, weights: mine.safetensors}}\n"
    )
    target = ROUND.format(policy="farthest", k=4, t=1) + "/tiles_semantic-refined/seams.json"
    done = snakemake(tmp_path, target, "--dry-run", configs=(USUAL, tmp_path / "other.yaml"), check=False)
    assert done.returncode and "priors.mine.weights: there is no mine.safetensors" in done.stdout


def test_a_photo_from_the_future_is_named_before_the_work(snakemake, tmp_path):
    """Snakemake refuses results that are older than their inputs, once a job has ended."""
    (photo := tmp_path / "a.jpg").touch()
    os.utime(photo, (0, time.time() + 3600))
    scene = f"{{kind: photos, folder: {tmp_path}, size: 64, start: 8, agent: replay, preset: draft, tiling: semantic}}"
    (tmp_path / "mine.yaml").write_text(f"scene: mine\nscenes: {{mine: {scene}}}\n")
    target = "results/mine/photos/ground.json"
    done = snakemake(tmp_path, target, "--dry-run", configs=(USUAL, tmp_path / "mine.yaml"), check=False)
    assert done.returncode and f"config: scenes.mine.folder: {photo} is dated in the future" in done.stdout


def test_cuts_by_colour_need_no_weights(planned, tmp_path):
    tiles = ROUND.format(policy="farthest", k=4, t=1) + "/tiles_colour/seams.json"
    (tmp_path / "none.yaml").write_text("lpips: installed")
    plan = planned(tmp_path, tiles)
    assert plan["cut_tiles"] == 1 and not plan["convert_lpips_weights"]


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(
            ASKED.replace("_terrain_pdrop{p_drop}_lam{lam}", "_none_pdrop0_lam0"), id="w2-lpips without a prior"
        ),
        pytest.param(
            ASKED.replace("w2-lpips", "w2").format(p_drop="0.1", lam="0.1"), id="lam for a policy without LPIPS"
        ),
        pytest.param(ASKED.format(p_drop="1", lam="0.1"), id="a share of dropout that leaves nothing"),
        pytest.param(ASKED.format(p_drop="0.1", lam="0.10"), id="lam with a trailing zero"),
        pytest.param("results/desert/seed0/draft/coarse/scores_none_pdrop0.1/scores.csv", id="dropout of no prior"),
        pytest.param(BUNDLE.format(**(DEFAULT | {"tau": "0.60"})), id="tau with a trailing zero"),
        pytest.param(BUNDLE.format(**(DEFAULT | {"k": "04"})), id="k with a leading zero"),
        pytest.param(STOP.format("_gain0.05_upto20"), id="the price before the number of photos"),
        pytest.param(STOP.format("_gain0"), id="a price of nothing"),
        pytest.param(STOP.format("_upto020"), id="a number of photos with a leading zero"),
        pytest.param(STOP.format("_gain0.050"), id="a price with a trailing zero"),
        pytest.param(
            "results/desert/seed0/draft/active_external_none_pdrop0_lam0_k0_upto9/iter0/levels",
            id="a stop of a finished field",
        ),
        pytest.param("results/Desert/seed0/views.json", id="a scene in capitals"),
        pytest.param(f"{LAM}/field.ply", id="lam for a policy without a prior"),
        pytest.param(f"{FARTHEST}/inpainted_none/levels", id="completed by no prior"),
        pytest.param(f"{FARTHEST}/inpainted_/levels", id="completed by nobody"),
        pytest.param(GIVEN + "/inpainted_terrain/field.ply", id="a finished field, completed"),
        pytest.param("results/moon/photos/ground.json", id="a scene that is not in the config"),
    ],
)
def test_a_second_spelling_of_a_path_has_no_rule(snakemake, tmp_path, path):
    done = snakemake(tmp_path, path, "--dry-run", check=False)
    assert done.returncode != 0 and "MissingRule" in done.stdout


@pytest.mark.parametrize(
    "path, said",
    [
        ("results/sweeps/nope.png", "there is no 'nope' in study.sweeps; it has k, p_drop"),
        ("results/desert/seed0/drat/coarse/field.ply", "there is no 'drat' in presets (is 'draft' meant?)"),
        (f"{FARTHEST}/tiles_smal/seams.json", "there is no 'smal' in tilings (is 'small' meant?)"),
    ],
)
def test_a_name_that_the_config_lacks_is_named_with_those_that_it_has(snakemake, tmp_path, path, said):
    done = snakemake(tmp_path, path, "--dry-run", check=False)
    assert done.returncode != 0 and said in done.stdout and "KeyError" not in done.stdout


def test_lists_and_k_can_be_given_on_the_command_line(planned, snakemake, tmp_path):
    given = ("--config", "seeds=[1, 2]", "views_per_round=3", "stills={width: 320, height: 180}")
    assert planned(tmp_path, *given)["fit_coarse"] == 2
    done = snakemake(tmp_path, *given, "--dry-run")
    assert "seed2/draft/active_coverage-error_none_pdrop0_lam0_k3/iter2/levels" in done.stdout


@pytest.mark.parametrize("policy", ["farthest", "w2-lpips"])
def test_a_completed_field_lies_between_the_round_and_its_levels(planned, tmp_path, policy):
    without, made = (
        planned(tmp_path, "--config", f"policy={policy}", f"inpaint={on}", configs=(USUAL, TINY))
        for on in (False, True)
    )
    assert not without["inpaint_field"] and not without["evaluate_inpainted"]
    assert made == without + Counter(inpaint_field=1, evaluate_inpainted=1)


def test_a_round_can_be_tiled_as_it_is_and_completed(planned, tmp_path):
    tiles = ROUND.format(policy="farthest", k=4, t=1) + "{}/tiles_semantic/seams.json"
    plan = planned(tmp_path, tiles.format(""), tiles.format("/inpainted_terrain"))
    assert plan["make_levels"] == plan["cut_tiles"] == 2 and plan["inpaint_field"] == plan["update_field"] == 1


def test_no_round_and_a_finished_field_go_from_field_to_terrain(planned, tmp_path):
    without = planned(tmp_path, "--config", "rounds=0")
    assert without["copy_coarse_field"] == without["make_page"] == 1 and not without["select_poses"]
    (tmp_path / "finished.ply").touch()
    given = planned(tmp_path, "--config", "scene=finished", configs=(USUAL, TINY))
    assert (
        given["import_field"] == given["prepare_external_field"] == given["make_page"] == given["render_terrain"] == 1
    )
    assert not given["fit_coarse"] and not given["copy_coarse_field"]


@pytest.mark.parametrize(
    "wrong, said",
    [
        ("tau: 1.5", "config: tau: input should be less than or equal to 1"),
        ("polcy: random", "config: there is no key 'polcy'; is 'policy' meant?"),
        ("scene: moon", "config: scene: there is no 'moon'; scenes has brighton_beach, caliterra_earthworks"),
        ("p_drop: 1", "config: p_drop: input should be less than 1"),
        ("prior: zero", "config: prior: there is no 'zero'; priors has terrain"),
        (
            "priors: {terrain: {samples: 1}}",
            "config: priors.terrain.samples: input should be greater",
        ),
        ("stop: {photos: 2}", "config: stop.photos: input should be greater than or equal to 3"),
        ("rounds: -1", "config: rounds: input should be greater than or equal to 0"),
        ("scenes: {desert: {preset: best}}", "config: scenes.desert.preset: there is no 'best'; presets has"),
        ("qualities: {}", "config: 'qualities' is called 'presets' now"),
    ],
)
def test_a_config_that_is_wrong_stops_before_the_first_job(snakemake, run, checkout, tmp_path, wrong, said):
    """The same words through Snakemake and through `make run`, which needs no more than one line."""
    (tmp_path / "wrong.yaml").write_text(wrong)
    done = snakemake(tmp_path, "--cores", "1", configs=(USUAL, tmp_path / "wrong.yaml"), check=False)
    assert done.returncode != 0 and said in done.stdout and "Traceback" not in done.stdout
    done = run(checkout(tmp_path / "clone"), "--configfile", tmp_path / "wrong.yaml")
    assert done.returncode == 1 and done.stdout.startswith(said) and done.stdout.count("\n") == 1


def test_a_config_that_is_not_yaml_is_named_with_its_line(run, checkout, tmp_path):
    folder = checkout(tmp_path)
    text = (folder / USUAL).read_text()
    (folder / USUAL).write_text(text.replace("seeds: [0]", "seeds: [0"))
    done = run(folder)
    assert done.returncode == 1 and done.stdout.startswith("config/config.yaml: not YAML") and "line" in done.stdout
    assert done.stdout.count("\n") == 1


def test_a_missing_folder_of_photos_is_named(snakemake, run, checkout, tmp_path):
    said = "config: scenes.copr_dunes.folder: there is no photos/of_nothing"
    (tmp_path / "missing.yaml").write_text("scenes: {copr_dunes: {folder: photos/of_nothing}}\n")
    folder = checkout(tmp_path / "clone")
    configs = (USUAL, tmp_path / "missing.yaml")
    done = snakemake(folder, "--dry-run", "--config", "scene=copr_dunes", configs=configs, check=False)
    assert done.returncode != 0 and said in done.stdout
    done = run(folder, "--scene", "copr_dunes", "--configfile", tmp_path / "missing.yaml")
    assert done.returncode == 1 and said in done.stdout and len(done.stdout.splitlines()) <= 4, done.stdout


def test_a_flight_is_planned_where_the_config_asks_for_one(planned, tmp_path):
    assert "render_flight" not in planned(tmp_path)
    (tmp_path / "flight.yaml").write_text("flight: {frames: 8, length: 1, height: 1}\n")
    plan = planned(tmp_path, configs=(USUAL, tmp_path / "flight.yaml"))
    assert plan["render_flight"] == plan["render_terrain"] == 1


def test_a_missing_height_map_is_named(snakemake, tmp_path):
    (tmp_path / "map.yaml").write_text("heights: {kind: image, file: no.exr, width: 10, height: 1}\n")
    done = snakemake(tmp_path, "--dry-run", configs=(USUAL, tmp_path / "map.yaml"), check=False)
    assert done.returncode != 0 and "config: heights.file: there is no no.exr" in done.stdout


def test_seams_are_measured_by_cells_that_share_the_levels(planned, tmp_path):
    """Two ways to cut besides the scene's own, which is one of them or not, and is drawn once or thrice; they too."""
    for own, replicates, twice, cells in (
        ("colour", 1, 1, 2),
        ("small", 1, 1, 3),
        ("small", 3, 1, 5),
        ("small", 3, 2, 7),
    ):
        study = f"scenes: [desert], tilings: [colour, semantic], baseline: colour, replicates: {replicates}"
        (tmp_path / "few.yaml").write_text(
            f"study: {{seams: {{{study}, compared_replicates: {twice}}}}}\nscenes: {{desert: {{tiling: {own}}}}}"
        )
        plan = planned(tmp_path, "seams", configs=(USUAL, TINY, tmp_path / "few.yaml"))
        assert plan["measure_seams"] == plan["cut_tiles"] == cells
        assert plan["measure_repetition"] == len({"colour", "semantic", own})
        assert plan["make_levels"] == plan["render_grid"] == plan["plot_cuts"] == plan["gather_seams"] == 1
