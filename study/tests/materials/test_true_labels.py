"""The map of true materials and objects: what it shows of known ground."""

import numpy as np
import pytest

from dav_gswt.geometry.scene_frame import Square
from dav_gswt.photos.synthetic import desert, meshes
from dav_gswt.photos.synthetic.land import GroundLabels
from dav_gswt_study.materials import true_labels

SQUARE = Square(-2.0, -1.0, 4.0)  # x from -2 to 2, y from -1 to 3


def ball(x, y, radius):
    """The vertices of a sphere about a place."""
    mesh = meshes.make_stone(np.random.default_rng(0), 4, desert.STONES)
    unit = mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True)
    return (radius * unit + [x, y, 0.0]).astype(np.float32)


@pytest.fixture
def known():
    """Meadow where y is from 0 to 4, sand elsewhere, over a period of 8; a shrub and two boulders, one far away."""
    material = np.ones((16, 16), int)
    material[:8] = 2
    objects = ball(1.0, 2.0, 0.5), ball(-1.0, 0.0, 0.25), ball(9.0, 0.0, 0.5)
    return GroundLabels({"sand": 1, "meadow": 2}, material, 8.0, objects)


def test_rows_of_the_map_run_to_the_north_and_the_material_repeats(known):
    found = true_labels.draw_label_map(known, SQUARE, 80)
    assert (found.material[:20] == 1).all() and (found.material[20:] == 2).all()
    row, column = np.argwhere(found.object == 1).mean(axis=0)
    assert (column, row) == pytest.approx(((1.0 + 2.0) * 20 - 0.5, (2.0 + 1.0) * 20 - 0.5), abs=0.3)
    far = true_labels.draw_label_map(known, Square(-2.0, -9.0, 12.0), 120)
    assert far.material[:, 7].tolist() == 10 * [2 - 1] + 40 * [2] + 40 * [1] + 30 * [2]


def test_the_footprint_of_an_object_is_its_outline_from_above_cut_at_the_border(known):
    found = true_labels.draw_label_map(known, SQUARE, 200)
    assert found.object.max() == 2  # not the far one
    cell = SQUARE.side / 200
    for number, radius in ((1, 0.5), (2, 0.25)):
        area = (found.object == number).sum() * cell**2
        assert area == pytest.approx(np.pi * radius**2, rel=0.12)  # half a cell around
    known = GroundLabels({"sand": 1}, np.ones((4, 4), int), 8.0, (ball(2.0, 0.0, 0.5),))
    found = true_labels.draw_label_map(known, SQUARE, 200)
    assert (found.object == 1).sum() * 0.02**2 == pytest.approx(np.pi * 0.5**2 / 2, rel=0.12)
