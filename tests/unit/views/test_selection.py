import json
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry.poses import Pose, select_farthest_poses
from dav_gswt.views import policies, scores, selection
from dav_gswt.views.policies import NEEDS_FIELD, POLICIES, SelectionInput, resolve_policy
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty import Scales


def scored(*places, **terms):
    """Candidates at azimuths (degrees) on the horizon of a unit circle."""
    given = {"opacity": [0.0] * len(places)} | terms
    columns = {name: np.array(values, float) for name, values in given.items()}
    found = [Pose(f"p{i}", 0.0, float(a), 1.0) for i, a in enumerate(places)]
    return Scores(found, columns, Scales(dict.fromkeys(columns, 2.0)))


class Sharing:
    """Information that fades for the neighbours of what was taken, as that of overlapping photos does."""

    def __init__(self, gains):
        self.now = list(gains)

    def gains(self):
        return list(self.now)

    def take(self, i):
        for j in (i - 1, i, i + 1):
            if 0 <= j < len(self.now):
                self.now[j] /= 10


def chosen(policy, pool, k, captured=((1.0, 0, 0),), seed=0, lam=0.0, information=None):
    inputs = SelectionInput(np.array(captured).reshape(-1, 3), k, np.random.default_rng(seed), lam, information)
    return [pose.name for pose in selection.select_poses(policy, pool, inputs)]


def test_farthest_chooses_the_opposite_side_then_the_gaps_breaks_ties_by_index_and_takes_no_pose_twice():
    names = chosen("farthest", scored(0, 90, 180, 270, 10), 3)
    assert names[0] == "p2" and set(names[1:]) == {"p1", "p3"}  # 90 and 270 are equal but for rounding
    assert chosen("farthest", scored(90, 90), 1) == ["p0"]
    assert sorted(chosen("farthest", scored(0, 0, 0), 3, captured=())) == ["p0", "p1", "p2"]
    assert select_farthest_poses(scored(0, 5, 180, 90).poses, 3) == [0, 2, 3]  # begins with the first
    assert select_farthest_poses(scored(0, 0).poses, 5) == [0, 1]


def test_w2_lpips_weights_lpips_by_lam_breaks_ties_by_index_and_refuses_scores_without_a_prior(caplog):
    pool = scored(0, 1, 2, 3, w2_sq=[1.0, 3, 2, 3], lpips=[9.0, 0, 4, 0])
    assert chosen("w2-lpips", pool, 2) == ["p1", "p3"]
    assert chosen("w2-lpips", pool, 2, lam=1e6) == ["p0", "p2"]
    assert chosen("w2-lpips", scored(0, 1, w2_sq=[1.0, 2]), 1, lam=1.0) == ["p1"]
    assert "its term is left out" in caplog.text
    with pytest.raises(InputError, match="w2_sq: the poses were scored without it"):
        chosen("w2-lpips", scored(0, 1), 1)


def test_w2_ignores_lpips_and_grad_lpips_uses_the_gradient_in_place_of_w2():
    pool = scored(0, 1, 2, w2_sq=[1.0, 3, 2], lpips=[9.0, 0, 0], gradient=[1.0, 0, 3])
    assert chosen("w2", pool, 2, lam=1e6) == ["p1", "p2"]
    assert chosen("grad-lpips", pool, 1) == ["p2"] and chosen("grad-lpips", pool, 1, lam=1e6) == ["p0"]
    assert chosen("single", scored(0, 1, 2, single=[0.1, 0.3, 0.2]), 2) == ["p1", "p2"]


@pytest.mark.parametrize("policy", NEEDS_FIELD)
def test_coverage_is_greedy_with_updates_and_ties_go_to_the_first(policy):
    sharing = Sharing([5.0, 4.9, 4.8, 1.0, 3.0, *([0.5] * 40)])
    assert chosen(policy, scored(*range(45)), 3, information=sharing) == ["p0", "p2", "p4"]
    assert chosen(policy, scored(0, 1, 2), 5, information=Sharing([1.0, 1.0, 1.0])) == ["p0", "p2", "p1"]


def test_all_and_any_policy_with_fewer_candidates_than_k_choose_every_candidate(caplog):
    assert chosen("all", scored(0, 1, 2), 3) == ["p0", "p1", "p2"]
    assert chosen("all", scored(0, 1, 2), 2) == ["p0", "p1", "p2"]
    assert sorted(chosen("farthest", scored(0, 90), 5)) == ["p0", "p1"]
    assert "all candidates that are left are taken: 2" in caplog.text
    assert chosen("farthest", scored(), 5) == []
    assert "no candidate pose is left" in caplog.text


def test_a_policy_has_a_name_that_can_stand_in_a_path_says_what_it_reads_and_auto_goes_by_the_agent():
    for name in ("", "W2", "w2_lpips"):
        with pytest.raises(ValueError, match="small letters, digits and -"):
            policies.policy(name, "nothing")(policies.everything)
    reads = {name: each.describe_inputs() for name, each in POLICIES.items()}
    assert (reads["farthest"], reads["coverage-error"], reads["w2-lpips"]) == ("poses", "field, photos", "prior")
    assert reads["single"] == "prior (not `p_drop`, `lam`)"
    assert [resolve_policy("auto", agent) for agent in ("replay", "render")] == ["farthest", "coverage-error"]
    assert resolve_policy("w2", "replay") == "w2"


def test_random_depends_on_its_generator_only():
    draw = [chosen("random", scored(*range(20)), 5, seed=s) for s in (1, 1, 2)]
    assert draw[0] == draw[1] != draw[2] and len(set(draw[0])) == 5


def test_a_selection_of_poses_is_read_as_written_and_only_a_copy_says_who_chose(tmp_path):
    own = selection.PoseSelection("farthest", 4, scored(0, 90).poses)
    for chosen in (own, replace(own, chosen_with="draft")):
        selection.write_pose_selection(tmp_path / "poses.json", chosen)
        assert selection.read_pose_selection(tmp_path / "poses.json") == chosen
        assert ("chosen_with" in json.loads((tmp_path / "poses.json").read_text())) == bool(chosen.chosen_with)
    (tmp_path / "poses.json").write_text('{"policy": "all", "k": 1, "poses": 3}')
    with pytest.raises(InputError, match=r"poses\.json: not as the workflow writes it"):
        selection.read_pose_selection(tmp_path / "poses.json")


def test_scores_are_read_as_written_to_the_bit_and_what_is_no_table_of_scores_is_refused(tmp_path):
    pool = scored(0.1, 33.3333333333, opacity=[1 / 3, 0.25], w2_sq=[1e-30, 7e20])
    scores.write_scores(tmp_path / "s.csv", pool)
    back = scores.read_scores(tmp_path / "s.csv")
    assert (back.poses, back.scales, list(back.terms)) == (pool.poses, pool.scales, ["opacity", "w2_sq"])
    assert all(np.array_equal(back.terms[name], values) for name, values in pool.terms.items())
    scores.write_scores(tmp_path / "none.csv", scored())
    assert len(scores.read_scores(tmp_path / "none.csv")) == 0
    scores.write_scores(tmp_path / "nan.csv", scored(0, 1, opacity=[float("nan"), 0]))
    scores.write_scores(tmp_path / "far.csv", scored(0, float("inf")))
    for name, line in (("short", "p0,1,2"), ("word", "p0,x,2,3" + "," * 9)):
        (tmp_path / f"{name}.csv").write_text(",".join(scores.list_columns()) + "\n" + line + "\n")
    reasons = {"nan": "the scores of p0 are not finite", "far": "a pose is not finite", "short": "not a table"}
    for name, reason in (reasons | {"word": "could not convert"}).items():
        with pytest.raises(InputError, match=reason):
            scores.read_scores(tmp_path / f"{name}.csv")
