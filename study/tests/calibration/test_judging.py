from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.geometry import poses
from dav_gswt.images import image_files
from dav_gswt.raster import render
from dav_gswt.views import scoring
from dav_gswt_study.calibration import judging


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


def test_a_score_that_knows_where_the_field_is_wrong_ranks_well(replayed):
    found, table = judge(replayed)
    assert found["poses"] == 12 and set(found["scores"]) == {"opacity", "coverage", "low", "far"}
    assert table[0]["pose"] == "p0.png" and len({row["pose"] for row in table}) == 12
    assert all(row["error"] > 0.02 for row in table)


def test_geometry_alone_is_what_a_score_has_to_beat():
    up, side = poses.Pose("", 90.0, 0.0, 2.0), poses.Pose("", 30.0, 0.0, 2.0)
    found = judging.geometric_baselines([up, side], [up])
    assert list(found["low"]) == [0, 60] and found["far"] == pytest.approx([0, 2.0])  # 60 degrees apart, 2 away
