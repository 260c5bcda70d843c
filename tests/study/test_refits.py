from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings
from dav_gswt.study import refits

COARSE = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=8)
UPDATE = UpdateSettings(size=48, max_gaussians=5000, steps_per_photo=8)
SETTINGS = refits.RefitSettings(COARSE, UPDATE, start=3, weights=None)
NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)


@pytest.fixture(scope="module")
def photos():
    views = made.photos(8)
    return refits.RefitPhotos(replace(made.FRAME, kind="synthetic"), views[:7], views[7:], lambda n: NONE, 0.15)


@pytest.fixture(scope="module")
def rows(photos):
    return refits.compare_refits(photos, SETTINGS, [2, 4], [1.0, 0.3], [0])


def test_all_ways_to_the_same_photos_take_the_same_steps(rows):
    assert [row["steps"] for row in rows if row["photos"] == 7] == [8 + 4 * 8] * 5
    assert [(row["photos_a_round"], row["first_rate"]) for row in rows[2:]] == [(2, 1.0), (2, 0.3), (4, 1.0), (4, 0.3)]


def test_photos_and_steps_gain_quality(rows):
    assert rows[1]["psnr"] > rows[0]["psnr"] + 1


def test_rounds_of_all_photos_are_one_refit_and_of_some_several(photos, monkeypatch):
    taken = []
    refine = refits.refine_field
    monkeypatch.setattr(
        refits, "refine_field", lambda given, *rest: taken.append(len(given.new)) or refine(given, *rest)
    )
    refits.compare_refits(photos, SETTINGS, [4, 3], [0.3], [0])
    assert taken == [4, 3, 1]


def test_rates_of_a_refit_change_the_field(rows):
    assert rows[2]["psnr"] != rows[3]["psnr"]


def test_photos_are_taken_far_from_those_before_and_the_rest_is_tested(tmp_path):
    views = made.photos(7)
    (tmp_path / "images").mkdir()
    names = tuple(f"{i}.png" for i in range(7))
    for name, view in zip(names, views, strict=True):
        image_files.write_png(tmp_path / "images" / name, view.image)
    none, cameras = np.zeros(0, int), tuple(view.camera for view in views)
    (tmp_path / "sparse").mkdir()
    write_colmap_model(ColmapModel(names, cameras, *NONE, none, none, np.zeros((0, 2))), tmp_path / "sparse")
    write_scene_frame(tmp_path / "ground.json", made.FRAME)
    split = ViewSplit(names[:2], names[2:6], names[6:])
    read = refits.read_refit_photos(tmp_path, split, 4, 48, 0.15)
    assert [view.name for view in read.views[:2]] == list(names[:2])
    left = set(names[2:6]) - {view.name for view in read.views}
    assert [view.name for view in read.tests][0] == names[6] and {view.name for view in read.tests[1:]} == left
    centres = np.array([view.camera.centre for view in views])
    near = [min(np.linalg.norm(centres[i] - centres[j]) for j in (0, 1)) for i in range(2, 6)]
    assert read.views[2].name == names[2 + int(np.argmax(near))]
