import json
import re
import textwrap
from dataclasses import replace

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry.poses import Pose, pose_of_camera, pose_offset, select_farthest_poses
from dav_gswt.views import policies, scores, selection
from dav_gswt.views.policies import POLICIES, SelectionInput
from dav_gswt.views.policy_names import NEEDS_FIELD, POLICY_NAMES, POLICY_SPECS, PolicySpec
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty import Scales


def scored(*places, **terms):
    """Candidates at azimuths (degrees) on the horizon of a unit circle."""
    given = {"opacity": [0.0] * len(places)} | terms
    columns = {name: np.array(values, float) for name, values in given.items()}
    found = [Pose(f"p{i}", 0.0, float(a), 1.0) for i, a in enumerate(places)]
    return Scores(found, columns, Scales(dict.fromkeys(columns, 2.0)), np.zeros(len(places), int))


class Sharing:
    """Information that fades for the neighbours of what was taken, as that of overlapping photos does."""

    def __init__(self, gains):
        self.now, self.looks = list(gains), 0

    def gains(self):
        return list(self.now)

    def gain(self, i):
        self.looks += 1
        return self.now[i]

    def take(self, i):
        for j in (i - 1, i, i + 1):
            if 0 <= j < len(self.now):
                self.now[j] /= 10


def chosen(policy, pool, k, captured=((1.0, 0, 0),), seed=0, lam=0.0, information=None):
    inputs = SelectionInput(np.array(captured).reshape(-1, 3), k, np.random.default_rng(seed), lam, information)
    return [pose.name for pose in selection.select_poses(policy, pool, inputs)]


def test_farthest_chooses_the_opposite_side_then_the_gaps():
    names = chosen("farthest", scored(0, 90, 180, 270, 10), 3)
    assert names[0] == "p2"  # 180 is farthest from 0; then come 90 and 270, equal but for rounding
    assert set(names[1:]) == {"p1", "p3"}


def test_farthest_breaks_ties_by_index():
    assert chosen("farthest", scored(90, 90), 1) == ["p0"]


def test_farthest_does_not_take_a_pose_twice_when_all_coincide():
    assert sorted(chosen("farthest", scored(0, 0, 0), 3, captured=())) == ["p0", "p1", "p2"]


def test_w2_lpips_weights_lpips_by_lam_and_breaks_ties_by_index():
    pool = scored(0, 1, 2, 3, w2_sq=[1.0, 3, 2, 3], lpips=[9.0, 0, 4, 0])
    assert chosen("w2-lpips", pool, 2) == ["p1", "p3"]
    assert chosen("w2-lpips", pool, 2, lam=1e6) == ["p0", "p2"]


def test_w2_lpips_warns_without_lpips_and_refuses_scores_without_a_prior(caplog):
    assert chosen("w2-lpips", scored(0, 1, w2_sq=[1.0, 2]), 1, lam=1.0) == ["p1"]
    assert "its term is left out" in caplog.text
    with pytest.raises(InputError, match="w2_sq: the poses were scored without it"):
        chosen("w2-lpips", scored(0, 1), 1)


def test_w2_ignores_lpips_and_grad_lpips_uses_the_gradient_in_place_of_w2():
    pool = scored(0, 1, 2, w2_sq=[1.0, 3, 2], lpips=[9.0, 0, 0], gradient=[1.0, 0, 3])
    assert chosen("w2", pool, 2, lam=1e6) == ["p1", "p2"]
    assert chosen("grad-lpips", pool, 1) == ["p2"] and chosen("grad-lpips", pool, 1, lam=1e6) == ["p0"]


@pytest.mark.parametrize("policy", NEEDS_FIELD)
def test_coverage_is_greedy_with_updates_and_evaluates_few_gains(policy):
    gains = [5.0, 4.9, 4.8, 1.0, 3.0, *([0.5] * 40)]
    sharing = Sharing(gains)
    assert chosen(policy, scored(*range(45)), 3, information=sharing) == ["p0", "p2", "p4"]
    assert sharing.looks <= 5  # p0, p1 (fell), p2, p4, not all 45 each time


def test_all_chooses_every_candidate_whatever_k_is_within_the_budget():
    assert selection.poses_per_round("all", 1, 3) == 3 and selection.poses_per_round("farthest", 1, 3) == 1
    assert chosen("all", scored(0, 1, 2), 3) == ["p0", "p1", "p2"]
    assert chosen("all", scored(0, 1, 2), 2) == ["p0", "p1"]


def test_every_described_policy_has_a_function():
    assert set(POLICIES) == set(POLICY_NAMES)


@pytest.mark.parametrize("name", ["", "W2", "w2_lpips", "w2 lpips", "w2/lpips"])
def test_the_name_of_a_policy_has_small_letters_digits_and_hyphens_only(name):
    with pytest.raises(ValueError, match="small letters, digits and -"):
        PolicySpec(name, "nothing")


def test_a_policy_says_what_it_reads():
    reads = {spec.name: spec.describe_inputs() for spec in POLICY_SPECS}
    assert (reads["farthest"], reads["oracle"]) == ("poses", "field, true pictures")
    assert (reads["coverage-error"], reads["w2-lpips"]) == ("field, photos", "prior")
    assert reads["single"] == "prior (not `p_drop`, `lam`)"


def test_the_policy_that_the_architecture_page_shows_chooses_as_it_says(root, monkeypatch):
    page = (root / "docs/architecture.md").read_text(encoding="utf-8").split("### A policy")[1]
    code = textwrap.dedent(re.search(r" *```python\n(.*?) *```", page, re.S)[1])
    monkeypatch.setattr(policies, "POLICY_NAMES", (*POLICY_NAMES, "lowest"))
    monkeypatch.setitem(POLICIES, "lowest", None)  # so that it leaves the table again
    exec(code, dict(vars(policies)))
    low, high = Pose("low", 40.0, 0.0, 1.0), Pose("high", 80.0, 0.0, 1.0)
    pool = Scores([high, low], {"opacity": np.zeros(2)}, Scales({"opacity": 0.0}), np.zeros(2, int))
    assert chosen("lowest", pool, 1) == ["low"]


def test_a_policy_that_is_not_described_cannot_be_registered():
    with pytest.raises(ValueError, match="describe the policy"):
        policies.policy("unknown")


def test_random_depends_on_its_generator_only():
    pool = scored(*range(20))
    draw = [chosen("random", pool, 5, seed=s) for s in (1, 1, 2)]
    assert draw[0] == draw[1] != draw[2]
    assert len(set(draw[0])) == 5


@pytest.mark.parametrize("policy", POLICIES)
def test_with_fewer_candidates_than_k_all_are_chosen_with_a_warning(policy, caplog):
    terms = dict(w2_sq=[0.0, 1], gradient=[1.0, 2], lpips=[1.0, 1], single=[0.1, 0])
    assert sorted(chosen(policy, scored(0, 90, **terms), 5, information=Sharing([1.0, 2.0]))) == ["p0", "p1"]
    assert "all candidates that are left are taken: 2" in caplog.text
    assert chosen(policy, scored(), 5) == []
    assert "no candidate pose is left" in caplog.text


def test_farthest_poses_start_with_the_first_candidate():
    assert select_farthest_poses(scored(0, 5, 180, 90).poses, 3) == [0, 2, 3]
    assert select_farthest_poses(scored(0, 0).poses, 5) == [0, 1]


def test_a_selection_of_poses_is_read_as_written(tmp_path):
    chosen = selection.PoseSelection("farthest", 4, scored(0, 90).poses, None, {"gain": 0.1})
    selection.write_pose_selection(tmp_path / "poses.json", chosen)
    assert selection.read_pose_selection(tmp_path / "poses.json") == chosen


def test_only_a_copy_says_who_chose(tmp_path):
    own = selection.PoseSelection("farthest", 4, [])
    for chosen in (own, replace(own, chosen_with="draft")):
        selection.write_pose_selection(tmp_path / "poses.json", chosen)
        assert selection.read_pose_selection(tmp_path / "poses.json") == chosen
        assert ("chosen_with" in json.loads((tmp_path / "poses.json").read_text())) == bool(chosen.chosen_with)


@pytest.mark.parametrize("content", ["[]", "{}", '{"policy": "all", "k": 1, "poses": 3}', '{"poses": [{}]}'])
def test_another_file_is_refused_as_a_selection_of_poses(tmp_path, content):
    (tmp_path / "poses.json").write_text(content)
    with pytest.raises(InputError, match=r"poses\.json: not as the workflow writes it"):
        selection.read_pose_selection(tmp_path / "poses.json")


def test_scores_are_read_as_written_to_the_bit(tmp_path):
    pool = scored(0.1, 33.3333333333, opacity=[1 / 3, 0.25], w2_sq=[1e-30, 7e20])
    scores.write_scores(tmp_path / "s.csv", pool)
    back = scores.read_scores(tmp_path / "s.csv")
    assert (back.poses, back.scales, list(back.terms)) == (pool.poses, pool.scales, ["opacity", "w2_sq"])
    assert all(np.array_equal(back.terms[name], values) for name, values in pool.terms.items())
    assert np.array_equal(back.steps, pool.steps)


def test_scores_without_candidates_are_a_table_without_rows(tmp_path):
    scores.write_scores(tmp_path / "s.csv", scored())
    assert len(scores.read_scores(tmp_path / "s.csv")) == 0


def test_scores_that_are_not_finite_name_their_poses(tmp_path):
    scores.write_scores(tmp_path / "s.csv", scored(0, 1, opacity=[float("nan"), 0]))
    with pytest.raises(InputError, match="p0"):
        scores.read_scores(tmp_path / "s.csv")


@pytest.mark.parametrize(
    ("line", "reason"), [("p0,1,2", "not a table"), ("p0,1,2,x" + "," * 11, "could not convert")], ids=["short", "word"]
)
def test_another_table_is_refused_as_scores(tmp_path, line, reason):
    (tmp_path / "s.csv").write_text(",".join(scores.FIELDS) + "\n" + line + "\n")
    with pytest.raises(InputError, match=reason):
        scores.read_scores(tmp_path / "s.csv")


def test_a_pose_has_the_place_of_its_camera():
    from dav_gswt.geometry import cameras

    frame = scene_frame(exemplar=(1.0, 2.0, 2.0))
    camera = cameras.pinhole([2.0, 3 + 3.0, 4.0], [2, 3, 0], 10, 10, 40.0)
    pose = pose_of_camera("x", camera, frame)
    assert (pose.azimuth, pose.radius) == (pytest.approx(90), pytest.approx(5))
    np.testing.assert_allclose(pose_offset(pose), [0, 3, 4], atol=1e-12)


def test_the_outcome_of_a_selection_has_the_reason_to_stop_and_the_expected_gain():
    ended = selection.PoseSelection("farthest", 2, [], "the gain is too small", {"gain": 0.1})
    assert ended.describe_outcome() == {"stopped": "the gain is too small", "expected": {"gain": 0.1}}
