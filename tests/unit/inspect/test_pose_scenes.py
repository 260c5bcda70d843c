"""Candidates over the exemplar: where they stand, what colours them, which were chosen."""

import shutil

import numpy as np
import pytest
from fixtures import result_tree

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.inspect import pose_scenes, scene
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import ColourBar

POSES = result_tree.poses()


def centres(layer):
    """Middles of a layer's balls, each of as many corners."""
    corners = len(scene.make_balls(np.zeros((1, 3)), 1.0, np.zeros((1, 3), np.uint8)).points)
    return layer.points.reshape(-1, corners, 3).mean(1)


def at(numbers):
    return np.array([result_tree.MIDDLE + pose_offset(POSES[i]) for i in numbers])


def test_scores_and_poses_find_each_other_and_show_the_same(tree):
    by_scores = pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions())
    by_poses = pose_scenes.build_poses(tree.round / "poses.json", ViewOptions())
    for one, other in zip(by_scores.layers, by_poses.layers, strict=True):
        np.testing.assert_array_equal(one.points, other.points)
    assert [word.text for word in by_poses.labels] == ["1", "2"]


def test_candidates_stand_where_they_are_and_the_chosen_are_marked_in_order(tree):
    shown = pose_scenes.build_poses(tree.round / "poses.json", ViewOptions())
    rest = [i for i in range(result_tree.CANDIDATES) if i not in result_tree.CHOSEN]
    np.testing.assert_allclose(centres(shown.layers[0]), at(rest), atol=1e-4)
    stems = next(layer for layer in shown.layers if layer.kind == "lines" and len(layer.cells) == 2)
    np.testing.assert_allclose(stems.points[0], result_tree.MIDDLE, atol=1e-6)
    np.testing.assert_allclose(stems.points[1:], at(result_tree.CHOSEN), atol=1e-5)
    for word, above in zip(shown.labels, at(result_tree.CHOSEN), strict=True):
        np.testing.assert_allclose(word.place[:2], above[:2], atol=1e-9)


def test_colours_are_the_uncertainty_that_the_policy_used_or_any_column(tree):
    default = pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions())
    assert isinstance(default.legend[0], ColourBar) and "W2" in default.legend[0].title
    opacity = pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions(colour="opacity"))
    first = opacity.layers[0].colours[0].astype(int)
    assert first[2] > first[0]  # cool: the first candidate has the least, and the most of the other
    assert default.layers[0].colours[0][0] > default.layers[0].colours[0][2]
    with pytest.raises(InputError, match="--colour hue: these poses have opacity, w2_sq"):
        pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions(colour="hue"))


def test_where_several_branches_chose_none_is_marked_until_one_is_named(tree, tmp_path):
    shutil.copytree(tree.photos.parent, tmp_path / "scene")
    draft = tmp_path / "scene/seed0/draft"
    twin = draft / result_tree.BRANCH.replace("k2", "k3")
    shutil.copytree(draft / result_tree.BRANCH, twin)
    scores = draft / "coarse/scores_terrain_pdrop0.15/scores.csv"
    shown = pose_scenes.build_scores(scores, ViewOptions())
    assert not shown.labels and "2 branches" in shown.notes[0]
    assert len(pose_scenes.build_scores(scores, ViewOptions(poses=twin / "iter1/poses.json")).labels) == 2


def test_poses_of_other_scores_are_refused(tree, tmp_path):
    strange = read_json(tree.round / "poses.json")
    strange["poses"][0]["name"] = "pose_9999"
    write_json(tmp_path / "poses.json", strange)
    with pytest.raises(InputError, match="pose_9999 is not among"):
        pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions(poses=tmp_path / "poses.json"))
    (tmp_path / "poses.json").write_text('{"poses": 3}')
    with pytest.raises(InputError, match="poses.json: not as the workflow writes it"):
        pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions(poses=tmp_path / "poses.json"))


def test_poses_outside_the_result_tree_are_said(tree, tmp_path):
    shutil.copy(tree.round / "poses.json", tmp_path)
    with pytest.raises(InputError, match="lies in no round"):
        pose_scenes.build_poses(tmp_path / "poses.json", ViewOptions())
    shutil.copy(tree.scored / "scores.csv", tmp_path)
    with pytest.raises(InputError, match="leave it in its result tree"):
        pose_scenes.build_scores(tmp_path / "scores.csv", ViewOptions())
