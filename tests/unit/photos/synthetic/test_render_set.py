"""The photos/ folder of a synthetic scene: what ground.json says about its test views, and what lies beside it."""

import numpy as np
import pytest

from dav_gswt.geometry.scene_frame import Extent, read_scene_frame
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.photos.synthetic import photo_set, truth
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic.labels import GroundLabels, read_label_map

ENTRY = {"family": "desert", "seed": 0, "photos": 3, "test": 2, "size": 64, "candidates": 0}


@pytest.fixture(autouse=True)
def dark(monkeypatch):
    """Black photos, in which no point is found: only the record is looked at here."""

    def nothing(folder, shots, seed):
        names, cameras = (tuple(column) for column in zip(*shots, strict=True))
        none = np.zeros(0, int)
        return ColmapModel(names, cameras, np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2)))

    monkeypatch.setattr(synthetic, "render", lambda scene, camera: np.zeros((64, 64, 3), np.float32))
    monkeypatch.setattr(truth, "write_truth", lambda path, scene, camera: path.write_text(str(camera.centre.tolist())))
    monkeypatch.setattr(synthetic, "load_labels", lambda scene: None)
    monkeypatch.setattr(photo_set, "triangulate_points", nothing)


@pytest.mark.parametrize(
    "given, groups",
    [
        pytest.param({}, {"hemisphere": ["test_00.png", "test_01.png"]}, id="ring"),
        pytest.param(
            {"layout": "cap", "min_elevation": 60, "oblique": 3},
            {"high": ["test_00.png", "test_01.png"], "oblique": ["test_02.png", "test_03.png", "test_04.png"]},
            id="cap",
        ),
        pytest.param(
            {"layout": "paper", "walkers": 2},
            {"hemisphere": ["test_00.png", "test_01.png"], "walker": ["test_02.png", "test_03.png"]},
            id="paper",
        ),
    ],
)
def test_test_views_are_written_by_group(tmp_path, given, groups):
    photo_set.render_set(ENTRY | given, tmp_path)
    frame = read_scene_frame(tmp_path / "ground.json")
    assert frame.test_groups == {group: tuple(names) for group, names in groups.items()}
    assert frame.test == tuple(name for group in groups.values() for name in group)
    stored = read_colmap_model(tmp_path / "sparse")
    for name, camera in zip(frame.test, synthetic.test_views(ENTRY | given), strict=True):
        assert stored.cameras[stored.names.index(name)].centre == pytest.approx(camera.centre)


def test_every_picture_has_its_truth_and_the_record_says_what_rendered(tmp_path):
    photo_set.render_set(ENTRY, tmp_path)
    pictures = sorted(p.stem for p in (tmp_path / "images").iterdir())
    assert pictures == ["test_00", "test_01", "view_00", "view_01", "view_02"]
    assert sorted(p.name for p in (tmp_path / "truth").iterdir()) == [f"{name}.exr" for name in pictures]
    assert set(read_scene_frame(tmp_path / "ground.json").renderer) == {"mitsuba", "variant", "llvm"}
    written = (tmp_path / "truth" / "test_01.exr").read_text()
    assert written == str(synthetic.test_views(ENTRY)[1].centre.tolist())


def test_a_family_with_labels_has_a_map_of_them_beside_the_truth(tmp_path, monkeypatch):
    known = GroundLabels({"sand": 1}, np.ones((4, 4), int), 16.0, (), frozenset())
    monkeypatch.setattr(synthetic, "load_labels", lambda scene: known)
    photo_set.render_set(ENTRY, tmp_path)
    found = read_label_map(tmp_path / "truth")
    assert (found.material == 1).all() and found.extent == Extent(-3.0, -3.0, 3.0, 3.0)


def test_names_of_more_than_a_hundred_views_sort_by_number():
    names = [name for name, _ in photo_set._name_views("view", synthetic.start_views(ENTRY | {"photos": 120}))]
    assert names == sorted(names) and names[0] == "view_000.png" and names[-1] == "view_119.png"
