"""What policies of coverage know: the field's error in the photos so far, the prior's maps, or the truth."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.errors import InputError
from dav_gswt.field import write_field
from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.raster import render
from dav_gswt.reconstruction import ground
from dav_gswt.views import oracle, policy_inputs
from dav_gswt.views.coverage import DirectionalCoverage, GroundCells
from dav_gswt.views.pose_maps import PoseMaps, write_pose_maps
from dav_gswt.views.scores import Scores
from dav_gswt.views.scoring import scoring_camera
from dav_gswt.views.uncertainty.weighting import Scales

SPLIT = ViewSplit(("p0.png", "p2.png"), (), ())


def pool():
    return patch.pool(3, turn=2.0)


@pytest.fixture
def files(tmp_path):
    """A field that is darker than its photos, and more so in the east."""
    true = patch.field()
    east = np.where(true.means[:, 0] > 1.6, 0.6, 0.1).astype(np.float32)[:, None, None]
    write_field(replace(true, sh=true.sh - east), tmp_path / "field.ply")
    ground.write_ground(patch.grid(), tmp_path / "ground.exr")
    write_scene_frame(tmp_path / "ground.json", replace(patch.FRAME, kind="synthetic"))
    views, names = [], [pose.name for pose, _ in pool()]
    for pose, camera in pool():
        picture = np.clip(render(true, camera).colour, 0, 1)
        image_files.write_png(tmp_path / pose.name, picture)
        views.append(TrainingView(pose.name, camera, picture, np.ones((96, 96), np.float32)))
    none = np.zeros(0, int)
    points = np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))
    (tmp_path / "sparse").mkdir()
    write_colmap_model(ColmapModel(tuple(names), tuple(c for _, c in pool()), *points), tmp_path / "sparse")
    oracle.write_truth(tmp_path / "truth", iter(views[1:]))
    known = np.where(true.means[:, 1] > 1.6, 0.8, 0.2).astype(np.float32)
    cells = GroundCells(true, patch.grid()).view([scoring_camera(camera) for _, camera in pool()]).pixels
    write_pose_maps(tmp_path / "maps.npz", PoseMaps(names, np.zeros((3, 4, 4), np.float32), None, cells), known)
    given = {name: tmp_path / f"{name}.{end}" for name, end in (("field", "ply"), ("ground", "exr"), ("maps", "npz"))}
    given |= {"frame": tmp_path / "ground.json", "images": tmp_path, "model": tmp_path / "sparse"}
    return given | {"truth": tmp_path / "truth", "captures": [], "fits": []}


def build(policy, files, agent="render"):
    scores = Scores([pose for pose, _ in pool()][::-1], {}, Scales({}), np.zeros(3, int))
    return policy_inputs.build_information_gain(policy, scores, pool(), [], SPLIT, files, agent)


def sides(files, policy, axis, agent="render"):
    """Mean importance of the cells that lie above the middle of an axis, and below."""
    found, cells = build(policy, files, agent).importance, policy_inputs.GroundCells(patch.field(), patch.grid())
    far = cells.middle[:, axis] > 1.6
    return found[far].mean(), found[~far].mean()


def test_without_a_weight_all_cells_count_alike(files):
    assert (build("coverage", files).importance == 1).all()


def test_gains_are_in_the_order_of_the_scores(files):
    cells, cameras = GroundCells(patch.field(), patch.grid()), [scoring_camera(camera) for _, camera in pool()][::-1]
    known = cells.view([])
    alone = [DirectionalCoverage(cells, known, cells.view([camera])).gain(0) for camera in cameras]
    assert build("coverage", files).gains() == alone and len(set(alone)) == 3


@pytest.mark.parametrize("policy, agent", [("coverage-error", "render"), ("oracle", "render"), ("oracle", "replay")])
def test_ground_that_is_shown_wrong_matters_more(files, policy, agent):
    east, west = sides(files, policy, 0, agent)
    assert east > 5 * west > 0


def test_photos_that_an_update_rejected_do_not_count(files, tmp_path):
    rejected = {"new_views": {"taken": False, "views": [{"view": name} for name in SPLIT.start]}}
    (tmp_path / "fit.json").write_text(json.dumps(rejected))
    assert (build("coverage-error", files | {"fits": [tmp_path / "fit.json"]}).importance == 1).all()


def test_the_prior_s_uncertainty_is_that_of_the_gaussians_over_a_cell(files):
    north, south = sides(files, "coverage-w2", 1)
    assert north / south == pytest.approx(4, rel=0.05)


def test_other_policies_read_nothing_and_no_truth_is_refused(files, tmp_path):
    assert build("farthest", {}) is None
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="shows no candidate that is left"):
        build("oracle", files | {"truth": tmp_path / "empty"})
