from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.geometry import cameras, poses
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.views import scoring
from dav_gswt.views.scoring import ground_mask
from dav_gswt_study.calibration import judging

SIDE = 48
GRID, FIELD = patch.grid(), patch.field()


def pool(count=12):
    return patch.pool(count, turn=0.9)


@pytest.fixture
def replayed(tmp_path):
    """A field that shows its south in false colours; photos of the truth."""
    truth = patch.field()
    for pose, camera in pool():
        image_files.write_png(tmp_path / pose.name, np.clip(render(truth, camera).colour, 0, 1))
    south = truth.means[:, 1] < 0.6
    colour = np.where(south[:, None, None], truth.sh + np.float32(0.8), truth.sh)
    wrong = replace(truth, sh=colour, uncertainty=np.where(south, 1, 0).astype(np.float32))
    return judging.CalibrationTarget(wrong, patch.grid(), patch.FRAME, patch.photos(), 96), tmp_path


def judge(replayed, count=12):
    judged, folder = replayed
    found = scoring.score_poses(judged.field, judged.grid, pool(), judged.taken, judged.frame, None)
    some = judging.choose_candidates(pool(), found.scores, folder, count)
    return judging.calibrate_scores(judged, *some, found.scores, 0.1, 0)


def test_every_candidate_is_compared_with_its_true_error(replayed):
    found, table = judge(replayed)
    assert found["poses"] == 12 and set(found["scores"]) == {"opacity", "coverage", "low", "far"}
    assert table[0]["pose"] == "p0.png" and len({row["pose"] for row in table}) == 12
    assert all(row["error"] > 0.02 for row in table)


def test_geometry_alone_is_what_a_score_has_to_beat():
    up, side = poses.Pose("", 90.0, 0.0, 2.0), poses.Pose("", 30.0, 0.0, 2.0)
    found = judging.geometric_baselines([up, side], [up])
    assert list(found["low"]) == [0, 60] and found["far"] == pytest.approx([0, 2.0])  # 60 degrees apart, 2 away


@pytest.fixture(scope="module")
def views():
    """Pictures of the field that show ground beyond the exemplar too."""
    eyes = [[1.6, 1.7, 4.0], [0.9, 2.2, 3.5]]
    at = [cameras.pinhole(eye, [1.6, 1.6, 0], SIDE, SIDE, 60.0) for eye in eyes]
    pictures = [np.clip(render(FIELD, camera).colour, 0, 1) for camera in at]
    whole = np.ones((SIDE, SIDE), np.float32)
    return [TrainingView(f"photo_{i}", *both, whole) for i, both in enumerate(zip(at, pictures, strict=True))]


def test_rmse_is_the_root_mean_square_over_channels_and_the_pixels_that_count(views):
    view = views[0]
    counts = ground_mask(GRID, view.camera) > 0
    columns = np.arange(SIDE) < 20
    off = np.where(counts & columns, np.float32(0.3), np.where(counts, np.float32(0), np.float32(0.7)))
    wrong = replace(view, image=view.image + off[..., None] * np.float32([0, 1, 0]))
    (error,) = judging.measure_errors(FIELD, GRID, [wrong], SIDE)
    assert 0 < counts.sum() < counts.size
    assert error == pytest.approx(0.3 / 3**0.5 * (counts & columns).sum() ** 0.5 / counts.sum() ** 0.5, abs=1e-5)
    hidden = replace(wrong, weight=(~columns * np.ones((SIDE, 1))).astype(np.float32))
    assert judging.measure_errors(FIELD, GRID, [hidden], SIDE) == pytest.approx([0], abs=1e-5)


def test_another_exposure_counts_unless_it_is_corrected_and_a_view_of_nothing_modelled_has_no_rmse(views):
    gain, offset = np.float32([0.8, 0.9, 0.7]), np.float32([0.1, 0.05, 0.0])
    other = [replace(view, image=gain * view.image + offset) for view in views]
    assert (judging.measure_errors(FIELD, GRID, other, SIDE) > 0.02).all()
    np.testing.assert_allclose(judging.measure_errors(FIELD, GRID, other, SIDE, corrected=True), 0, atol=1e-5)
    aside = replace(views[0], camera=cameras.pinhole([90, 90, 4], [90, 90.1, 0], SIDE, SIDE, 40.0))
    assert np.isnan(judging.measure_errors(FIELD, GRID, [aside, views[1]], SIDE)).tolist() == [True, False]
