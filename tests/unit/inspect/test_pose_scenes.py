"""Candidates and photos over the exemplar: where they stand, what colours them, which were chosen."""

import shutil

import numpy as np
import pytest
from fixtures import result_tree

from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.geometry.cameras import camera_to_json
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.inspect import photo_scenes, pose_scenes, result_files, scene
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import ColourBar

POSES = result_tree.poses()
CORNERS = len(scene.make_balls(np.zeros((1, 3)), 1.0, np.zeros((1, 3), np.uint8)).points)  # of a ball


def at(numbers):
    return np.array([result_tree.MIDDLE + pose_offset(POSES[i]) for i in numbers])


def test_candidates_stand_where_they_are_in_the_policy_s_colours_and_the_chosen_are_marked_in_order(tree):
    shown = pose_scenes.build_poses(tree.round / "poses.json", ViewOptions())
    by_scores = pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions())
    for one, other in zip(by_scores.layers, shown.layers, strict=True):
        np.testing.assert_array_equal(one.points, other.points)
    assert [word.text for word in shown.labels] == ["1", "2"]
    rest = [i for i in range(result_tree.CANDIDATES) if i not in result_tree.CHOSEN]
    np.testing.assert_allclose(shown.layers[0].points.reshape(-1, CORNERS, 3).mean(1), at(rest), atol=1e-4)
    stems = next(layer for layer in shown.layers if layer.kind == "lines" and len(layer.cells) == 2)
    np.testing.assert_allclose(stems.points[0], result_tree.MIDDLE, atol=1e-6)
    np.testing.assert_allclose(stems.points[1:], at(result_tree.CHOSEN), atol=1e-5)
    assert isinstance(by_scores.legend[0], ColourBar) and "W2" in by_scores.legend[0].title
    opacity = pose_scenes.build_scores(tree.scored / "scores.csv", ViewOptions(colour="opacity"))
    (warm, _, cold), (cool, _, hot) = by_scores.layers[0].colours[0], opacity.layers[0].colours[0]
    assert warm > cold and hot > cool  # the first candidate has the most of the one and the least of the other


def test_poses_of_other_scores_or_outside_the_result_tree_are_refused(tree, tmp_path):
    scores, mine = tree.scored / "scores.csv", tmp_path / "poses.json"
    with pytest.raises(InputError, match="--colour hue: these poses have opacity, w2_sq"):
        pose_scenes.build_scores(scores, ViewOptions(colour="hue"))
    shutil.copy(tree.round / "poses.json", tmp_path)
    with pytest.raises(InputError, match="lies in no round"):
        pose_scenes.build_poses(mine, ViewOptions())
    shutil.copy(scores, tmp_path)
    with pytest.raises(InputError, match="leave it in its result tree"):
        pose_scenes.build_scores(tmp_path / "scores.csv", ViewOptions())
    mine.write_text(mine.read_text().replace("pose_0", "pose_9"))
    with pytest.raises(InputError, match="pose_9.* is not among"):
        pose_scenes.build_scores(scores, ViewOptions(poses=mine))
    mine.write_text('{"poses": 3}')
    with pytest.raises(InputError, match="poses.json: not as the workflow writes it"):
        pose_scenes.build_scores(scores, ViewOptions(poses=mine))


def test_a_camera_is_a_pyramid_whose_base_fills_its_picture():
    camera = result_tree.camera(result_tree.poses()[3])
    (layer,) = photo_scenes.make_frustum(camera, 0.5, (1, 2, 3), None)
    np.testing.assert_allclose(layer.points[0], camera.centre, atol=1e-5)
    pixels, depth = camera.project(layer.points[1:].astype(float))
    np.testing.assert_allclose(pixels, [[0, 0], [24, 0], [24, 16], [0, 16]], atol=1e-3)
    np.testing.assert_allclose(depth, 0.5, atol=1e-5)


def test_photos_hang_in_their_pyramids(tree):
    shown = photo_scenes.build_photos(tree.photos, ViewOptions())
    hung = [layer for layer in shown.layers if layer.picture is not None]
    assert [int(layer.picture[0, 0, 0]) for layer in hung] == [204, 51, 128]  # test_00, view_00, view_01


def test_names_that_lead_out_of_the_folder_are_refused(tmp_path):
    camera = camera_to_json(result_tree.camera(POSES[0]))
    for got, said in (({}, "not as the workflow writes it"), (camera, "is no file's name")):
        write_json(tmp_path / "capture.json", {"shots": [{"name": "../../secret.png", "got": got}]})
        with pytest.raises(InputError, match=said):
            result_files.read_shots(tmp_path / "capture.json")
