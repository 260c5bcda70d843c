"""Maps as pictures and as the colours of the ground."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.inspect import map_scenes as seen
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import ColourBar
from dav_gswt.reconstruction.ground import Ground


def test_a_ground_is_a_surface_through_its_cells_with_a_colour_each():
    heights = np.array([[0.0, 0, 0], [1.0, 1, 1]])
    grid = Ground(10.0, 20.0, 0.5, 0, 0, 2, heights, np.ones((2, 3), bool))
    layer = seen.make_surface(grid, np.arange(6.0).reshape(2, 3), ColourBar("", 0.0, 5.0), 100)
    assert layer.points.shape == (12, 3) and layer.cells.shape == (6, 4)
    np.testing.assert_allclose(layer.points[layer.cells[5]].mean(0)[:2], [11.25, 20.75])  # the north-eastern one
    np.testing.assert_allclose(np.unique(layer.points[:, 2]), [0, 0.5, 1])
    assert layer.colours[5][0] > layer.colours[5][2] and layer.colours[0][2] > layer.colours[0][0]


def test_a_large_ground_is_thinned_over_the_same_area():
    grid = Ground(0.0, 0.0, 1.0, 0, 0, 8, np.zeros((8, 8)), np.ones((8, 8), bool))
    layer = seen.make_surface(grid, np.zeros((8, 8)), ColourBar("", 0.0, 1.0), 16)
    assert len(layer.cells) == 16
    np.testing.assert_array_equal(layer.points.max(0)[:2], [8, 8])


def test_the_part_above_lies_over_the_ground_beside_it_with_its_first_row_in_the_north(tree):
    (layer,) = seen.build_map(tree.round / "uncertainty.exr", ViewOptions(part="above")).layers
    warm = layer.colours[:, 0] > layer.colours[:, 2]
    y = layer.points[layer.cells].mean(1)[:, 1]
    assert warm.sum() == 96 and y[warm].min() > y[~warm].max()


def test_all_channels_are_pictures_side_by_side_upright(tree):
    shown = seen.build_map(tree.round / "uncertainty.exr", ViewOptions())
    assert [word.text for word in shown.labels] == ["above uncertainty", "pose_0003 opacity"]
    above = shown.layers[0]
    assert above.picture[0, 0, 0] > above.picture[-1, 0, 0]  # the northern row is warm, and on top
    np.testing.assert_allclose(above.points[0][:2], [0, 0])
    assert shown.flat and above.points[3][1] < above.points[0][1] and above.points[1][0] > above.points[0][0]
    only = seen.build_map(tree.round / "uncertainty.exr", ViewOptions(channel="opacity"))
    assert len(only.layers) == 1 and [bar.title for bar in only.legend] == ["opacity"]


def test_maps_of_a_pose_are_pictures_where_they_are_asked_for(tree):
    shown = seen.build_pose_maps(tree.round / "maps.npz", ViewOptions(part="pose_0002"))
    assert [word.text for word in shown.labels] == ["pose_0002 opacity"]
    assert shown.layers[0].picture.shape == (8, 12, 3)


def test_a_part_or_channel_that_is_not_there_is_answered_with_those_that_are(tree):
    with pytest.raises(InputError, match="--part below: .* has above, pose_0003"):
        seen.build_map(tree.round / "uncertainty.exr", ViewOptions(part="below"))
    with pytest.raises(InputError, match="--channel Q: .* has opacity, uncertainty"):
        seen.build_map(tree.round / "uncertainty.exr", ViewOptions(channel="Q"))
    with pytest.raises(InputError, match="--channel Q: .* has Z, seen"):
        seen.build_map(tree.round / "ground.exr", ViewOptions(channel="Q"))


def test_maps_of_another_ground_and_headers_that_lie_are_refused(tree, tmp_path):
    image_files.write_exr(tmp_path / "ground.exr", {"Z": np.zeros((4, 4))}, {"ground_west": "far"})
    with pytest.raises(InputError, match="ground.exr: not the grid of a ground"):
        seen.build_map(tmp_path / "ground.exr", ViewOptions())
    above, other = ({"uncertainty": np.zeros((4, 4))}, {}), ({"a": np.zeros((2, 2))}, {})
    image_files.write_exr_parts(tmp_path / "uncertainty.exr", {"above": above, "b": other})
    with pytest.raises(InputError, match="ground.exr"):
        seen.build_map(tmp_path / "uncertainty.exr", ViewOptions(part="above"))


def test_skies_are_grey(tmp_path):
    image_files.write_exr(tmp_path / "deep.exr", {"Z": np.array([[np.inf, 1.0], [2.0, 3.0]])})
    shown = seen.build_map(tmp_path / "deep.exr", ViewOptions())
    np.testing.assert_array_equal(shown.layers[0].picture[0, 0], [150, 150, 150])
    assert "grey" in shown.notes[0]


def test_a_header_that_promises_too_much_is_refused_before_anything_is_made_room_for(tmp_path):
    image_files.write_exr(tmp_path / "a.exr", {"Z": np.zeros((3, 5))})
    data = (tmp_path / "a.exr").read_bytes()
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    huge = np.array([0, 0, 99_999, 99_999], "<i4").tobytes()
    (tmp_path / "a.exr").write_bytes(data[:at] + huge + data[at + 16 :])
    with pytest.raises(InputError, match="a.exr: not readable as EXR .*100000 x 100000 pixels"):
        seen.build_map(tmp_path / "a.exr", ViewOptions())


def test_a_folder_of_materials_shows_its_map(tmp_path):
    layers = {name: np.eye(4, dtype=np.float32) for name in ("material", "object", "excluded")}
    image_files.write_exr(tmp_path / "materials.exr", layers, {"west": "0.0"})
    shown = seen.build_materials(tmp_path, ViewOptions())
    assert len(shown.layers) == len(seen.build_map(tmp_path / "materials.exr", ViewOptions()).layers) > 0
    with pytest.raises(InputError, match="Q"):
        seen.build_materials(tmp_path, ViewOptions(channel="Q"))
