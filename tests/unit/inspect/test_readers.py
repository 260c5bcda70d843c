"""What readers make of artefacts: places and colours."""

import shutil

import numpy as np
import pytest
from fixtures import result_tree
from scipy.spatial.transform import Rotation

from dav_gswt import field as fields
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.images import image_files
from dav_gswt.inspect import plot, readers

POSES = result_tree.poses()
MOST = 300_000


def one(sigma=(0.1, 0.1, 0.1), ground=False, turn=None, opacity=4.0, uncertainty=0.0):
    return GaussianField(
        np.float32([[1.0, 2.0, 3.0]]),
        np.log(np.float32([sigma])),
        np.roll((turn or Rotation.identity()).as_quat(), 1)[None].astype(np.float32),
        np.float32([opacity]),
        rgb_to_sh(np.array([[0.2, 0.4, 0.6]])),
        np.float32([uncertainty]),
        np.array([ground]),
    )


def test_a_field_is_coloured_by_what_is_asked_or_says_why_it_cannot_be(tmp_path):
    fields.write_field(one(uncertainty=1.0), tmp_path / "a.ply")
    for by, colour in (
        ("colour", [51, 102, 153]),
        ("uncertainty", plot.map_colours(plot.make_bar(0.0, 1.0), np.ones(1))[0]),
    ):
        ((mesh, _),) = readers.read_scene(tmp_path / "a.ply", MOST, colour=by).meshes
        np.testing.assert_array_equal(mesh.cell_data["rgb"][0], colour)
    with pytest.raises(InputError, match="--colour hue: .* has colour, uncertainty"):
        readers.read_scene(tmp_path / "a.ply", MOST, colour="hue")
    fields.write_field(one(opacity=-9.0), tmp_path / "field.ply")
    with pytest.raises(InputError, match="there is nothing to draw"):
        readers.read_scene(tmp_path / "field.ply", MOST)


def test_the_part_above_lies_over_the_ground_with_its_first_row_in_the_north_and_all_are_pictures_upright(tree):
    ((mesh, _),) = readers.read_scene(tree.round / "uncertainty.exr", MOST, part="above").meshes
    warm = mesh.point_data["rgb"][:, 0] > mesh.point_data["rgb"][:, 2]
    y = mesh.points[:, 1]
    assert warm.sum() == 96 and y[warm].min() > y[~warm].max()
    shown = readers.read_scene(tree.round / "uncertainty.exr", MOST)
    (corners, how), _, (other, _), _ = shown.meshes  # each with its letters
    rows = how["texture"].to_array()
    assert rows[0, 0, 0] > rows[-1, 0, 0]  # the northern row is warm, and on top
    np.testing.assert_allclose(corners.points, [[0, 0, 0], [1, 0, 0], [1, -1, 0], [0, -1, 0]])
    np.testing.assert_allclose(corners.active_texture_coordinates, [[0, 1], [1, 1], [1, 0], [0, 0]])
    assert other.points[0, 0] > 1 and list(shown.bars) == ["uncertainty", "opacity"]


def test_parts_channels_grounds_and_headers_that_do_not_fit_are_refused(tree, tmp_path):
    image_files.write_exr(tmp_path / "ground.exr", {"Z": np.zeros((4, 4))}, {"ground_west": "far"})
    above, other = ({"uncertainty": np.zeros((4, 4))}, {}), ({"a": np.zeros((2, 2))}, {})
    image_files.write_exr_parts(tmp_path / "uncertainty.exr", {"above": above, "b": other})
    for path, options, said in (
        (tree.round / "uncertainty.exr", {"part": "below"}, "--part below: .* has above, pose_0003"),
        (tree.round / "uncertainty.exr", {"channel": "Q"}, "--channel Q: .* has opacity, uncertainty"),
        (tree.round / "ground.exr", {"channel": "Q"}, "--channel Q: .* has Z, seen"),
        (tmp_path / "ground.exr", {}, "ground.exr: not the grid of a ground"),
        (tmp_path / "uncertainty.exr", {"part": "above"}, "ground.exr"),
    ):
        with pytest.raises(InputError, match=said):
            readers.read_scene(path, MOST, **options)


def test_candidates_stand_where_they_are_in_the_policy_s_colours_and_the_chosen_are_marked_in_order(tree):
    shown, by_scores = (readers.read_scene(p, MOST) for p in (tree.round / "poses.json", tree.scored / "scores.csv"))
    at = result_tree.MIDDLE + np.array([pose_offset(pose) for pose in POSES])
    rest = [i for i in range(result_tree.CANDIDATES) if i not in result_tree.CHOSEN]
    (small, _), (large, _), *marks = shown.meshes
    corners = small.n_points // len(rest)
    np.testing.assert_allclose(small.points.reshape(-1, corners, 3).mean(1), at[rest], atol=1e-4)
    middles = large.points.reshape(-1, corners, 3).mean(1)
    np.testing.assert_allclose(middles, at[list(result_tree.CHOSEN)], atol=1e-4)
    stems = [mesh.points for mesh, _ in marks[:4:2]]
    np.testing.assert_allclose(stems, [[result_tree.MIDDLE, at[i]] for i in result_tree.CHOSEN], atol=1e-5)
    assert "W2" in next(iter(by_scores.bars))
    opacity = readers.read_scene(tree.scored / "scores.csv", MOST, colour="opacity")
    (warm, _, cold), (cool, _, hot) = (s.meshes[0][0].point_data["rgb"][0] for s in (by_scores, opacity))
    assert warm > cold and hot > cool  # the first candidate has the most of the one and the least of the other


def test_poses_of_other_scores_or_outside_the_result_tree_are_refused(tree, tmp_path, monkeypatch):
    scores, mine = tree.scored / "scores.csv", tmp_path / "poses.json"
    with pytest.raises(InputError, match="--colour hue: .* has opacity, w2_sq"):
        readers.read_scene(scores, MOST, colour="hue")
    shutil.copy(tree.round / "poses.json", tmp_path)
    with pytest.raises(InputError, match="lies in no round"):
        readers.read_scene(mine, MOST)
    shutil.copy(scores, tmp_path)
    with pytest.raises(InputError, match="leave it in its result tree"):
        readers.read_scene(tmp_path / "scores.csv", MOST)
    monkeypatch.setattr(readers, "find_scores", lambda path: scores)
    mine.write_text(mine.read_text().replace("pose_0", "pose_9"))
    with pytest.raises(InputError, match="poses.json: .*is not among"):
        readers.read_scene(mine, MOST)
