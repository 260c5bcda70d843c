import numpy as np
import pytest

from dav_gswt.geometry.scene_frame import Extent
from dav_gswt.images import image_files
from dav_gswt_study.materials import accuracy
from dav_gswt_study.materials.true_labels import LabelMap

BARE = np.zeros((20, 20), int)


def at(rows, columns):
    objects = BARE.copy()
    objects[rows, columns] = 1
    return objects


def truth(objects=None):
    """20 x 20 cells: sand (1) in the west, meadow (2) in the east; an object of 4 x 4 cells."""
    material = np.ones((20, 20), int)
    material[:, 12:] = 2
    objects = at(slice(4, 8), slice(4, 8)) if objects is None else objects
    return LabelMap(material, objects, Extent(0.0, 0.0, 2.0, 2.0), {"sand": 1, "meadow": 2})


def found(material, objects=BARE):
    middles = (np.arange(20) + 0.5) * 0.1
    return accuracy.FoundLabels(material, material, objects, np.zeros((20, 20), bool), middles, middles)


def test_the_truth_has_all_points_and_one_class_for_all_the_iou_of_the_larger_material_alone():
    exact = found(2 - truth().material, truth().object)  # meadow 0, sand 1: numbers are only names
    assert accuracy.score_materials(truth(), exact)["mean_iou"] == 1
    assert accuracy.score_objects(truth(), exact)["f1"] == 1
    scores = accuracy.score_materials(truth(), found(BARE))
    sand = (20 * 12 - 16) / (400 - 16)
    assert scores["iou_sand"] == pytest.approx(sand)
    assert scores["mean_iou"] == pytest.approx(sand / 2)


def test_an_object_beside_its_place_is_wrong_and_one_at_the_border_does_not_count():
    scores = accuracy.score_objects(truth(), found(BARE, at(slice(12, 16), slice(12, 16))))
    assert (scores["found"], scores["wrong"], scores["f1"]) == (0, 1, 0)
    border = truth(at(slice(0, 4), slice(5, 9)))
    scores = accuracy.score_objects(border, found(BARE, at(slice(0, 3), slice(5, 9))))
    assert (scores["objects"], scores["wrong"]) == (0, 0)


def test_the_label_map_of_a_materials_folder_is_read(tmp_path):
    none = np.zeros((2, 2), np.float32)
    layers = {"material": none, "kind": np.arange(4, dtype=np.float32).reshape(2, 2), "object": none}
    header = {"west": "1.5", "south": "-2.0", "spacing": "0.5"}
    image_files.write_exr(tmp_path / "materials.exr", layers | {"excluded": np.eye(2, dtype=np.float32)}, header)
    labels = accuracy.read_found_labels(tmp_path)
    assert labels.kind.tolist() == [[2, 3], [0, 1]]
    assert labels.excluded.tolist() == [[False, True], [True, False]]
    np.testing.assert_allclose((labels.x, labels.y), ([1.75, 2.25], [-1.75, -1.25]))
