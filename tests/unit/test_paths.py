from pathlib import Path

import pytest

from dav_gswt.paths import (
    decode_path,
    encode_branch,
    encode_number,
    related_folder,
    stage_folder,
)


def test_a_number_has_one_spelling():
    assert [encode_number(value) for value in ("0.10", 0, -0.0, 100.0, 1e-4)] == ["0.1", "0", "0", "100", "0.0001"]


CONFIG = {
    "seeds": [0],
    "policy": "w2-lpips",
    "prior": "terrain",
    "p_drop": 0.15,
    "lam": 0.1,
    "k": 4,
    "rounds": 2,
    "inpaint": True,
    "tau": 0.6,
    "scenes": {
        "sand": {"kind": "synthetic", "preset": "draft", "tiling": "auto"},
        "splat": {"kind": "field", "preset": "draft", "tiling": "auto"},
    },
}


@pytest.mark.parametrize("scene", ["sand", "splat"])
@pytest.mark.parametrize("stage", ["terrain", "round"])
def test_a_stage_of_a_branch_is_decoded_again(scene, stage):
    wildcards = {key: str(value) for key, value in encode_branch(CONFIG, scene).items()} | {"seed": "0"}
    decoded = decode_path(stage_folder(stage, wildcards) / "any.file")
    assert decoded and decoded == {key: wildcards[key] for key in decoded}


def test_the_path_of_a_branch_spells_every_setting():
    folder = stage_folder("bundle", encode_branch(CONFIG, "sand") | {"seed": 0})
    assert folder.as_posix() == (
        "results/sand/seed0/draft/active_w2-lpips_terrain_pdrop0.15_lam0.1_k4/iter2/inpainted_terrain"
        "/tiles_auto/bundle_tau0.6"
    )
    branch = encode_branch(CONFIG, "sand", changes={"k": 8, "tiling": "colour"})
    assert (branch["k"], branch["tiling"]) == (8, "colour")


@pytest.mark.parametrize(
    "policy, spelled",
    [("farthest", ("none", "0", "0")), ("w2", ("terrain", "0.15", "0")), ("single", ("terrain", "0", "0"))],
)
def test_settings_that_a_policy_does_not_read_have_one_spelling(policy, spelled):
    branch = encode_branch(CONFIG, "sand", policy)
    assert (branch["prior"], branch["p_drop"], branch["lam"]) == spelled


def test_where_all_photos_start_and_none_can_be_taken_there_are_no_rounds():
    def rounds(**entry) -> int:
        scenes = {"sand": CONFIG["scenes"]["sand"] | entry}
        return encode_branch(CONFIG | {"scenes": scenes}, "sand", "farthest")["t"]

    assert [rounds(agent="replay"), rounds(agent="replay", start=8), rounds(agent="plan")] == [0, 2, 2]


def test_the_folders_of_a_run_are_found_from_any_of_its_files():
    scores = Path("/home/me/results/sand/seed0/draft/active_w2_terrain_pdrop0.15_lam0_k4/iter2/scores.csv")
    fit = Path("/home/me/results/sand/seed0/draft")
    assert related_folder(scores, "round", t=1) == scores.parents[1] / "iter1"
    assert related_folder(scores, "scored") == fit / "coarse/scores_terrain_pdrop0.15"
    assert related_folder(scores, "fit") == fit
    assert decode_path("photos/of/mine.jpg") == {}
    with pytest.raises(ValueError, match="lies in no result tree"):
        related_folder("photos/of/mine.jpg", "fit")
