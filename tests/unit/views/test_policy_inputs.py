"""What the oracle sees: the true error at every candidate whose truth is known, from photos or from pictures drawn."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.errors import InputError
from dav_gswt.field import write_field
from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import ground
from dav_gswt.views import oracle, policy_inputs
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty.weighting import Scales


def pool():
    return patch.pool(3, turn=2.0)


@pytest.fixture
def files(tmp_path):
    """A field that is darker than its photos, and more so in the last of them."""
    true = patch.field()
    write_field(replace(true, sh=true.sh - np.float32(0.1)), tmp_path / "field.ply")
    ground.write_ground(patch.grid(), tmp_path / "ground.exr")
    write_scene_frame(tmp_path / "ground.json", replace(patch.FRAME, kind="synthetic"))
    views = []
    for i, (pose, camera) in enumerate(pool()):
        picture = np.clip(render(true, camera).colour + np.float32(0.2 * (i == 2)), 0, 1)
        image_files.write_png(tmp_path / pose.name, picture)
        views.append(TrainingView(pose.name, camera, picture, np.ones((96, 96), np.float32)))
    oracle.write_truth(tmp_path / "truth", iter(views[1:]))
    given = {"field": tmp_path / "field.ply", "ground": tmp_path / "ground.exr", "frame": tmp_path / "ground.json"}
    return given | {"images": tmp_path, "truth": tmp_path / "truth"}


def errors(files, agent, policy="oracle"):
    scores = Scores([pose for pose, _ in pool()][::-1], {}, Scales({}), np.zeros(3, int))
    return policy_inputs.measure_true_errors(policy, scores, pool(), files, {"agent": agent}, 96)


def test_of_a_replayed_scene_every_photo_tells_in_the_order_of_the_scores(files):
    found = errors(files, "replay")
    assert np.isfinite(found).all() and found[0] > 2 * found[1:].max()
    assert np.array_equal(found, errors(files, "replay", "oracle-diverse"))


def test_of_a_rendered_scene_only_what_was_drawn_is_known(files):
    found = errors(files, "render")
    assert np.isnan(found).tolist() == [False, False, True] and found[0] > 2 * found[1]


def test_other_policies_look_at_nothing_and_no_truth_is_refused(files, tmp_path):
    assert errors({}, "replay", "farthest") is None
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="shows no candidate that is left"):
        errors(files | {"truth": tmp_path / "empty"}, "render")
