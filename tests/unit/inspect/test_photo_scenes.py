"""Cameras over the ground: what they look at, what they are for."""

import numpy as np
import pytest
from fixtures import result_tree

from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.inspect import photo_scenes, result_files
from dav_gswt.inspect.options import ViewOptions


def test_a_camera_is_a_pyramid_whose_base_fills_its_picture():
    camera = result_tree.camera(result_tree.poses()[3])
    (layer,) = photo_scenes.make_frustum(camera, 0.5, (1, 2, 3), None)
    np.testing.assert_allclose(layer.points[0], camera.centre, atol=1e-5)
    pixels, depth = camera.project(layer.points[1:].astype(float))
    np.testing.assert_allclose(pixels, [[0, 0], [24, 0], [24, 16], [0, 16]], atol=1e-3)
    np.testing.assert_allclose(depth, 0.5, atol=1e-5)


def test_photos_hang_in_their_pyramids_with_the_points_and_the_exemplar(tree):
    shown = photo_scenes.build_photos(tree.photos, ViewOptions())
    hung = [layer for layer in shown.layers if layer.picture is not None]
    assert [int(layer.picture[0, 0, 0]) for layer in hung] == [204, 51, 128]  # test_00, view_00, view_01
    points = next(layer for layer in shown.layers if layer.kind == "points")
    np.testing.assert_array_equal(points.colours, 255 * np.eye(3))
    assert {"start", "test", "exemplar"} <= set(shown.legend[0].named)
    assert "3 cameras, 3 points; unit: metre" in shown.notes


def test_the_photos_of_a_round_join_those_of_the_scene(tree):
    shown = photo_scenes.build_capture(tree.round / "capture/capture.json", ViewOptions())
    assert "taken for a round" in shown.legend[0].named
    assert sum(layer.picture is not None for layer in shown.layers) == 5


def test_names_that_lead_out_of_the_folder_are_refused(tree, tmp_path):
    shot = {"name": "../../secret.png", "got": {}}
    write_json(tmp_path / "capture.json", {"shots": [shot]})
    with pytest.raises(InputError, match="not as the workflow writes it"):
        result_files.read_shots(tmp_path / "capture.json")
    from dav_gswt.geometry.cameras import camera_to_json

    shot["got"] = camera_to_json(result_tree.camera(result_tree.poses()[0]))
    write_json(tree.start / "capture.json", {"shots": [shot]})
    try:
        with pytest.raises(InputError, match="is no file's name"):
            photo_scenes.build_capture(tree.start / "capture.json", ViewOptions())
    finally:
        (tree.start / "capture.json").unlink()
