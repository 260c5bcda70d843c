from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from fixtures import ground as patch

from dav_gswt.geometry import poses
from dav_gswt.images import image_files
from dav_gswt.prior.networks import Network
from dav_gswt.prior.terrain import TerrainPrior, pack_render
from dav_gswt.raster import render
from dav_gswt.views import scoring
from dav_gswt.views.prior_sampling import PriorConfig
from dav_gswt_study.calibration import judging

METHODS = ("sample", "decode")


@pytest.fixture(scope="module")
def model():
    """A prior that learned nothing."""
    torch.manual_seed(0)
    network = Network()
    torch.nn.init.normal_(network.denoiser.conv_out.weight, std=0.1)
    return TerrainPrior(network)


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


def judge(replayed, prior=None, count=12):
    judged, folder = replayed
    found = scoring.score_poses(judged.field, judged.grid, pool(), judged.taken, judged.frame, prior)
    some = judging.choose_candidates(pool(), found.scores, folder, count)
    return judging.calibrate_scores(judged, *some, (found.scores, found.maps), 0.1, 0, prior)


def test_a_score_that_knows_where_the_field_is_wrong_ranks_well(replayed):
    found, table = judge(replayed)
    assert found["poses"] == 12 and set(found["scores"]) == {"opacity", "coverage", "low", "far"}
    assert found["scores"]["opacity"]["pixel_spearman"] > 0.2
    assert found["scores"]["opacity"]["pixel_ause"] < 0.75 * found["scores"]["opacity"]["pixel_ause_chance"]
    assert table[0]["pose"] == "p0.png" and len({row["pose"] for row in table}) == 12
    assert all(row["error"] > 0.02 for row in table)


def test_geometry_alone_is_what_a_score_has_to_beat():
    up, side = poses.Pose("", 90.0, 0.0, 2.0), poses.Pose("", 30.0, 0.0, 2.0)
    found = judging.geometric_baselines([up, side], [up])
    assert list(found["low"]) == [0, 60] and found["far"] == pytest.approx([0, 2.0])  # 60 degrees apart, 2 away


def test_controls_are_what_they_say(model):
    """From `sample` itself: how far samples from other noises lie apart, and their mean from the render."""
    condition, _ = scoring.build_conditions(patch.field(), patch.grid(), pool(2), patch.photos(), patch.FRAME, 64)
    prior = PriorConfig(model, 3, 2, 0.2, seed=4)
    found = judging.control_maps(prior, condition)
    drawn = model.sample(condition, 3, 0.0, 2, 4, common=False)
    pairs = [((drawn[:, i] - drawn[:, j]) ** 2).sum(1) for i, j in ((0, 1), (0, 2), (1, 2))]
    np.testing.assert_allclose(found["spread"], np.mean(pairs, 0), rtol=1e-4)
    apart = ((drawn.mean(1) - model.encode(pack_render(condition)).numpy()) ** 2).sum(1)
    np.testing.assert_allclose(found["residual"], apart, rtol=1e-4)
    other = SimpleNamespace(name="not the project's own", size=64, small=False, **dict.fromkeys(METHODS, print))
    assert judging.control_maps(replace(prior, model=other), condition) == {}
