"""What a sweep recomputes: the stages below the parameter it varies, and no others."""

import subprocess
import sys

import pytest
from made_runs import TINY, USUAL

ROUND = "results/desert/seed0/draft/active_{policy}_none_pdrop0_lam0_k{k}/iter{t}"
BUNDLE = ROUND + "/tiles_colour/bundle_tau{tau}/davgswt.json"
DEFAULT = dict(policy="farthest", k=4, t=2, tau=0.6)
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
    once = ["render_photos", "split_views", "fit_coarse", "score_coarse", "crop_level", "cut_tiles", "bundle_tiles"]
    assert all(plan[rule] == 1 for rule in [*once, "make_page", "render_terrain"])
    assert plan["fit_level"] == 2 and plan["update_field"] == plan["capture_views"] == 2
    assert plan["evaluate_coarse"] == 1 and plan["evaluate_round"] == 2


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(BUNDLE.format(**(DEFAULT | {"tau": "0.60"})), id="tau with a trailing zero"),
        pytest.param(BUNDLE.format(**(DEFAULT | {"k": "04"})), id="k with a leading zero"),
        pytest.param("results/Desert/seed0/views.json", id="a scene in capitals"),
        pytest.param(f"{LAM}/field.ply", id="lam for a policy without a prior"),
        pytest.param("results/moon/photos/ground.json", id="a scene that is not in the config"),
    ],
)
def test_a_second_spelling_of_a_path_has_no_rule(snakemake, tmp_path, path):
    done = snakemake(tmp_path, path, "--dry-run", check=False)
    assert done.returncode != 0 and "MissingRule" in done.stdout


def test_no_round_and_a_finished_field_go_from_field_to_terrain(planned, tmp_path):
    without = planned(tmp_path, "--config", "rounds=0")
    assert without["begin_active"] == without["make_page"] == 1 and not without["select_poses"]
    (tmp_path / "finished.ply").touch()
    given = planned(tmp_path, "--config", "scene=finished", configs=(USUAL, TINY))
    assert given["import_field"] == given["enter_field"] == given["make_page"] == given["render_terrain"] == 1
    assert not given["fit_coarse"] and not given["begin_active"]


@pytest.mark.parametrize(
    "wrong, said",
    [
        ("tau: 1.5", "config: tau: 1.5 is greater than the maximum of 1"),
        ("polcy: random", "config: there is no key 'polcy'; is 'policy' meant?"),
        ("scene: moon", "config: scene: there is no 'moon'; scenes has desert, flowers, grass, planet, meadow"),
        ("rounds: -1", "config: rounds: -1 is less than the minimum of 0"),
        ("scenes: {desert: {quality: best}}", "config: scenes.desert.quality: there is no 'best'; qualities has"),
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
    said = "config: scenes.copr_dunes.folder: there is no folder ../shared/data/copr_dunes/images"
    folder = checkout(tmp_path / "no" / "photos")
    done = snakemake(folder, "--dry-run", "--config", "scene=copr_dunes", check=False)
    assert done.returncode != 0 and said in done.stdout
    done = run(folder, "--scene", "copr_dunes")
    assert done.returncode == 1 and said in done.stdout and len(done.stdout.splitlines()) <= 4, done.stdout


def test_the_workflow_is_lint_clean_but_for_its_environment(snakemake, tmp_path):
    """One pip environment serves all rules, so lint's wish for a conda or container directive a rule is not met."""
    done = snakemake(tmp_path, "--lint", check=False)
    wishes = [line.strip() for line in done.stdout.splitlines() if line.strip().startswith("* ")]
    assert not [wish for wish in wishes if "No conda/container" not in wish and "environment" not in wish], done.stdout


@pytest.mark.parametrize(
    "tool",
    [
        pytest.param(["ruff", "check", "."], id="ruff check"),
        pytest.param(["ruff", "format", "--check", "."], id="ruff format"),
        pytest.param(["snakefmt", "--check", "Snakefile", "rules"], id="snakefmt"),
    ],
)
def test_the_code_is_formatted(root, tool):
    done = subprocess.run([sys.executable, "-m", *tool], cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
