"""Dry runs in empty folders: what is planned once, what a second spelling of a path finds, what is refused."""

import numpy as np
import pytest
from fixtures.runs import TINY, USUAL

from dav_gswt.images import image_files
from dav_gswt.views.policies import POLICY_NAMES, PRIOR_POLICIES, ZERO_SETTINGS

DRAFT = "results/desert/seed0/draft"
ROUND = DRAFT + "/active_{policy}_none_pdrop0_lam0_k{k}/iter{t}"
BUNDLE = ROUND + "/tiles_small/bundle_tau{tau}/davgswt.json"
DEFAULT = dict(policy="farthest", k=4, t=2, tau=0.6)
FARTHEST = ROUND.format(policy="farthest", k=4, t=1)
ASKED = DRAFT + "/active_w2-lpips_terrain_pdrop{p_drop}_lam{lam}_k4/iter1/metrics.json"


def test_the_default_target_makes_every_stage_once(planned, tmp_path):
    plan = planned(tmp_path)
    once = ["render_photos", "split_views", "fit_coarse", "score_coarse", "make_levels", "cut_tiles", "bundle_tiles"]
    assert all(plan[rule] == 1 for rule in [*once, "make_page", "render_terrain", "evaluate_coarse"])
    assert plan["update_field"] == plan["capture_views"] == plan["evaluate_round"] == 2


def test_values_of_a_sweep_share_the_stages_before_them(planned, tmp_path):
    """Two values each of tau (one set of tiles), k, rounds (a shared prefix) and policy; one coarse field for all."""
    changes = [{}, {"tau": 0.3}, {"k": 2}, {"t": 1}, {"policy": "random"}]
    plan = planned(tmp_path, *(BUNDLE.format(**(DEFAULT | change)) for change in changes))
    wanted = dict(fit_coarse=1, score_coarse=1, update_field=2 + 2 + 2, cut_tiles=4, bundle_tiles=5)
    assert {rule: plan[rule] for rule in wanted} == wanted


def test_a_prior_scores_once_for_every_lam_and_anew_for_every_p_drop(planned, tmp_path):
    pairs = [("0.15", "0"), ("0.15", "0.1"), ("0.3", "0.1")]
    plan = planned(tmp_path, *(ASKED.format(p_drop=p, lam=lam) for p, lam in pairs))
    assert plan["score_coarse"] == 2 and plan["select_poses"] == plan["update_field"] == 3
    assert plan["fit_coarse"] == 1


def test_every_policy_has_a_path(planned, tmp_path):
    targets = []
    for policy in POLICY_NAMES:
        values = {"prior": "none", "p_drop": "0", "lam": "0"}
        if policy in PRIOR_POLICIES:
            values = {"prior": "terrain", "p_drop": "0.15", "lam": "0.1"}
            values |= dict.fromkeys(ZERO_SETTINGS.get(policy, ()), "0")
        branch = "{}_{prior}_pdrop{p_drop}_lam{lam}".format(policy, **values)
        targets.append(f"{DRAFT}/active_{branch}_k4/iter1/field.ply")
    plan = planned(tmp_path, *targets)
    assert plan["update_field"] == plan["select_poses"] == len(POLICY_NAMES)


def test_presets_share_the_rounds_of_the_preset_that_chooses_for_them(planned, tmp_path):
    """Each round may be the last: its photos are fitted at once."""
    targets = [BUNDLE.format(**DEFAULT).replace("draft", name) for name in ("draft", "standard", "reference")]
    plan = planned(tmp_path, *targets)
    assert plan["fit_coarse"] == plan["score_coarse"] == 1 and plan["select_poses"] == plan["update_field"] == 2
    assert plan["fit_windows"] == 2 and plan["copy_chosen_photos"] == 4 and plan["make_levels"] == 3


def test_a_folder_alone_is_a_scene_whose_photos_are_all_fitted_at_once(planned, tmp_path):
    """With names that Snakemake takes for wildcards, in subfolders; presets share the photos' places."""
    for name in ("{abc}.jpg", "<results>/2 b.jpg", "2.jpg", "2_mask.jpg", "masks/x.png"):
        (tmp_path / "my {photos}" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "my {photos}" / name).write_bytes(b"\xff\xd8\xff")
    (tmp_path / "mine.yaml").write_text("scene: Sand_Pit\nscenes: {Sand_Pit: {kind: photos, folder: 'my {photos}'}}\n")
    configs = (USUAL, tmp_path / "mine.yaml")
    plan = planned(tmp_path, configs=configs)
    assert plan["register_photos"] == plan["fit_coarse"] == plan["make_page"] == 1
    assert not any(plan[rule] for rule in ("score_round", "select_poses", "capture_views", "update_field"))
    metrics = "results/Sand_Pit/seed0/{}/coarse/metrics.json"
    plan = planned(tmp_path, metrics.format("draft"), metrics.format("standard"), configs=configs)
    assert plan["register_photos"] == plan["split_views"] == 1 and plan["fit_coarse"] == 2


def test_a_copy_of_a_photo_is_no_input(snakemake, tmp_path):
    (tmp_path / "photos").mkdir()
    for name, content in {"a": b"a", "a (1)": b"a", "b": b"b"}.items():
        (tmp_path / f"photos/{name}.jpg").write_bytes(b"\xff\xd8\xff" + content)
    (tmp_path / "mine.yaml").write_text("scenes: {mine: {kind: photos, folder: photos}}\n")
    configs = (USUAL, tmp_path / "mine.yaml")
    said = snakemake(tmp_path, "results/mine/photos/ground.json", "--dry-run", configs=configs).stdout
    assert "photos/a.jpg" in said and "photos/b.jpg" in said and "a (1)" not in said


@pytest.mark.parametrize("start", ["", "start: 2, "])
def test_the_last_fit_of_a_preset_that_chooses_with_another_is_of_windows_unless_the_whole_is_wanted(
    planned, tmp_path, start
):
    """Of the draft's field of the same photos, also where all photos are fitted at once."""
    (tmp_path / "photos").mkdir()
    for name in "abcd":
        (tmp_path / f"photos/{name}.jpg").write_bytes(b"\xff\xd8\xff")
    entry = f"kind: photos, folder: photos, {start}preset: standard"
    for name, more in {"focus": "", "whole": ", exemplar: whole", "one": ", materials: one"}.items():
        (tmp_path / "mine.yaml").write_text(f"scene: mine\nscenes: {{mine: {{{entry}{more}}}}}\n")
        plan = planned(tmp_path, configs=(USUAL, tmp_path / "mine.yaml"))
        focused, rounds = name == "focus", 2 if start else 0
        assert (
            plan["fit_windows"] == focused
            and plan["fit_coarse"] == 1
            and plan["update_field"] == rounds - (0 if focused or not rounds else 1)
        )
        assert plan["fit_chosen_photos"] == (bool(rounds) and not focused)
        assert plan["copy_coarse_field"] == (not rounds and not focused)
        assert plan["evaluate_round"] == (rounds or focused)


def test_a_height_map_of_the_config_is_an_input_of_the_page_if_it_can_be_read(planned, snakemake, tmp_path):
    image_files.write_grey16(tmp_path / "hills.png", np.zeros((4, 5), np.uint16))
    (tmp_path / "hills.yaml").write_text("heights: {kind: image, file: hills.png, width: 9, height: 2}\n")
    configs = (USUAL, TINY, tmp_path / "hills.yaml")
    assert planned(tmp_path, configs=configs)["make_page"] == 1
    (tmp_path / "hills.png").write_bytes(b"no picture")
    done = snakemake(tmp_path, "--dry-run", configs=configs, check=False)
    assert "config: heights.file: " in done.stdout


def test_the_frames_of_a_video_are_chosen_before_they_are_registered(planned, tmp_path):
    (tmp_path / "walk.mp4").write_bytes(b"\0\0\0\x18ftypisom" + bytes(40))
    entry = "{kind: photos, folder: walk.mp4, size: 256, start: 2, agent: replay, preset: draft, tiling: small}"
    (tmp_path / "video.yaml").write_text(f"scene: walk\nscenes: {{walk: {entry}}}\n")
    plan = planned(tmp_path, configs=(USUAL, TINY, tmp_path / "video.yaml"))
    assert plan["choose_frames"] == plan["register_photos"] == plan["make_page"] == 1


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(BUNDLE.format(**(DEFAULT | {"tau": "0.60"})), id="a trailing zero"),
        pytest.param(ROUND.format(policy="w2-lpips", k=4, t=1) + "/field.ply", id="w2-lpips without a prior"),
    ],
)
def test_a_second_spelling_of_a_path_has_no_rule(snakemake, tmp_path, path):
    done = snakemake(tmp_path, path, "--dry-run", check=False)
    assert done.returncode != 0 and "MissingRule" in done.stdout


def test_a_name_that_the_config_lacks_is_reported_with_the_names_that_it_has(snakemake, tmp_path):
    done = snakemake(tmp_path, f"{FARTHEST}/tiles_smal/seams.json", "--dry-run", check=False)
    assert done.returncode != 0 and "there is no 'smal' in tilings (is 'small' meant?)" in done.stdout


def test_a_config_that_is_wrong_stops_before_the_first_job(snakemake, run, checkout, tmp_path):
    """The same words through Snakemake and through `make run`, which needs no more than one line."""
    (tmp_path / "wrong.yaml").write_text("polcy: random")
    said = "config: there is no key 'polcy'; is 'policy' meant?"
    done = snakemake(tmp_path, "--cores", "1", configs=(USUAL, tmp_path / "wrong.yaml"), check=False)
    assert done.returncode != 0 and said in done.stdout and "Traceback" not in done.stdout
    done = run(checkout(tmp_path / "clone"), "--configfile", tmp_path / "wrong.yaml")
    assert done.returncode == 1 and done.stdout.startswith(said) and done.stdout.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["copr_dunes", "brighton_beach", "caliterra_earthworks"])
def test_scenes_of_the_real_photos_are_planned(planned, root, tmp_path, scene):
    (tmp_path / "resources").symlink_to(root / "resources")
    assert planned(tmp_path, "--config", f"scene={scene}")["register_photos"] == 1
