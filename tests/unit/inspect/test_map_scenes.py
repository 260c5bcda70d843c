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
    thin = seen.make_surface(grid, np.zeros((2, 3)), ColourBar("", 0.0, 1.0), 2)  # a cell of two by two, and the rest
    assert len(thin.cells) == 2
    np.testing.assert_array_equal(thin.points.max(0)[:2], [12, 21])


def test_the_part_above_lies_over_the_ground_with_its_first_row_in_the_north_and_all_are_pictures_upright(tree):
    (layer,) = seen.build_map(tree.round / "uncertainty.exr", ViewOptions(part="above")).layers
    warm = layer.colours[:, 0] > layer.colours[:, 2]
    y = layer.points[layer.cells].mean(1)[:, 1]
    assert warm.sum() == 96 and y[warm].min() > y[~warm].max()
    shown = seen.build_map(tree.round / "uncertainty.exr", ViewOptions())
    assert [word.text for word in shown.labels] == ["above uncertainty", "pose_0003 opacity"]
    above = shown.layers[0]
    assert above.picture[0, 0, 0] > above.picture[-1, 0, 0]  # the northern row is warm, and on top
    np.testing.assert_allclose(above.points[0][:2], [0, 0])
    assert shown.flat and above.points[3][1] < above.points[0][1] and above.points[1][0] > above.points[0][0]


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
            seen.build_map(path, ViewOptions(**options))


def test_a_folder_of_materials_shows_its_map_whose_holes_are_grey(tmp_path):
    layers = {"material": np.array([[np.inf, 1], [2, 3]], np.float32), "object": np.eye(2, dtype=np.float32)}
    image_files.write_exr(tmp_path / "materials.exr", layers, {"west": "0.0"})
    shown = seen.build_materials(tmp_path, ViewOptions())
    assert len(shown.layers) == 2 and "grey" in shown.notes[0]
    np.testing.assert_array_equal(shown.layers[0].picture[0, 0], [150, 150, 150])
