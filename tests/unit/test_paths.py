from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.paths import (
    decode_path,
    decode_stop,
    describe_tree,
    encode_branch,
    encode_number,
    encode_stop,
    related_folder,
    stage_folder,
)


@pytest.mark.parametrize(
    "value, text",
    [(0.1, "0.1"), ("0.10", "0.1"), (0, "0"), (-0.0, "0"), (1.0, "1"), (20, "20"), (100.0, "100"), (1e-4, "0.0001")],
)
def test_a_number_has_one_spelling(value, text):
    assert encode_number(value) == text


@pytest.mark.parametrize(
    "stop, text",
    [
        ({}, ""),
        ({"photos": 20}, "_upto20"),
        ({"marginal_gain": 0.05}, "_gain0.05"),
        ({"marginal_gain": 1.0, "photos": 100}, "_upto100_gain1"),
    ],
)
def test_a_stop_has_one_spelling(stop, text):
    assert encode_stop(stop) == text and decode_stop(text) == stop


@given(st.integers(3, 100_000), st.decimals(min_value="0.0001", max_value=100, places=6))
def test_what_is_spelled_is_read_back(photos, worth):
    for stop in (
        {"photos": photos},
        {"marginal_gain": float(worth)},
        {"photos": photos, "marginal_gain": float(worth)},
    ):
        assert decode_stop(encode_stop(stop)) == stop


@pytest.mark.parametrize(
    "text", ["_upto020", "_upto5.0", "_gain0.50", "_gain", "_gain1_upto5", "upto5", "_upto5_", "_upto5_upto6", "_x"]
)
def test_another_spelling_is_refused(text):
    with pytest.raises(ValueError, match="does not say when rounds end|invalid literal"):
        decode_stop(text)


CONFIG = {
    "seeds": [0],
    "policy": "w2-lpips",
    "prior": "terrain",
    "p_drop": 0.15,
    "lam": 0.1,
    "k": 4,
    "rounds": 2,
    "stop": {"photos": 20},
    "inpaint": True,
    "tau": 0.6,
    "scenes": {
        "sand": {"kind": "synthetic", "preset": "draft", "tiling": "auto"},
        "splat": {"kind": "field", "preset": "draft", "tiling": "auto"},
    },
}


@pytest.mark.parametrize("scene", ["sand", "splat"])
@pytest.mark.parametrize("stage", ["terrain", "bundle", "tiles", "levels", "round"])
def test_a_stage_of_a_branch_is_decoded_again(scene, stage):
    wildcards = {key: str(value) for key, value in encode_branch(CONFIG, scene).items()} | {"seed": "0"}
    decoded = decode_path(stage_folder(stage, wildcards) / "any.file")
    assert decoded and decoded == {key: wildcards[key] for key in decoded}


def test_the_path_of_a_branch_spells_every_setting():
    folder = stage_folder("bundle", encode_branch(CONFIG, "sand") | {"seed": 0})
    assert folder.as_posix() == (
        "results/sand/seed0/draft/active_w2-lpips_terrain_pdrop0.15_lam0.1_k4_upto20/iter2/inpainted_terrain"
        "/tiles_auto/bundle_tau0.6"
    )


@pytest.mark.parametrize(
    "policy, spelled",
    [("farthest", ("none", "0", "0")), ("w2", ("terrain", "0.15", "0")), ("single", ("terrain", "0", "0"))],
)
def test_settings_that_a_policy_does_not_read_have_one_spelling(policy, spelled):
    branch = encode_branch(CONFIG, "sand", policy)
    assert (branch["prior"], branch["p_drop"], branch["lam"]) == spelled


@pytest.mark.parametrize(
    "agent, policy", [("replay", "farthest"), ("render", "coverage-error"), ("plan", "coverage-error")]
)
def test_auto_is_a_policy_by_where_photos_come_from(agent, policy):
    scenes = {"sand": CONFIG["scenes"]["sand"] | {"agent": agent}}
    assert encode_branch(CONFIG | {"policy": "auto", "scenes": scenes}, "sand")["policy"] == policy
    assert encode_branch(CONFIG | {"scenes": scenes}, "sand")["policy"] == "w2-lpips"


def test_settings_can_replace_those_of_the_config():
    branch = encode_branch(CONFIG, "sand", changes={"k": 8, "tiling": "colour"})
    assert (branch["k"], branch["tiling"]) == (8, "colour")


def test_a_path_outside_the_tree_decodes_to_nothing():
    assert decode_path("photos/of/mine.jpg") == {}


def test_the_readme_of_the_results_shows_the_tree(root):
    assert describe_tree() in (root / "results/README.md").read_text()


def test_the_folders_of_a_run_are_found_from_any_of_its_files():
    scores = Path("/home/me/results/sand/seed0/draft/active_w2_terrain_pdrop0.15_lam0_k4/iter2/scores.csv")
    fit = Path("/home/me/results/sand/seed0/draft")
    assert related_folder(scores, "round", t=1) == scores.parents[1] / "iter1"
    assert related_folder(scores, "scored") == fit / "coarse/scores_terrain_pdrop0.15"
    assert related_folder(scores, "fit") == fit


def test_a_path_outside_the_tree_has_no_related_folder():
    with pytest.raises(ValueError, match="lies in no result tree"):
        related_folder("photos/of/mine.jpg", "fit")
