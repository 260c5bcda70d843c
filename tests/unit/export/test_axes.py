"""Fields in the axes of other formats: known Gaussians keep their shapes; the box about their rims."""

import numpy as np
import pytest
from fixtures.random_field import random_field
from scipy.spatial.transform import Rotation

from dav_gswt.export import spool
from dav_gswt.export.axes import turn_field
from dav_gswt.export.spool import Spool
from dav_gswt.raster.interface import RIM

ANY = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()


@pytest.fixture
def known():
    """Twenty Gaussians of three unlike axes."""
    return random_field(20, seed=8)


def covariances(field):
    turn = Rotation.from_quat(field.quats[:, [1, 2, 3, 0]]).as_matrix()
    return np.einsum("nij,nj,nkj->nik", turn, np.exp(2.0 * field.log_scales), turn)


def test_covariances_turn_with_the_frame_and_back_gives_the_field_again(known):
    turned = turn_field(known, ANY)
    assert covariances(turned) == pytest.approx(ANY @ covariances(known) @ ANY.T, abs=1e-4)
    again = turn_field(turned, ANY.T)
    assert again.means == pytest.approx(known.means, abs=1e-6)
    assert covariances(again) == pytest.approx(covariances(known), abs=1e-4)
    assert np.array_equal(again.log_scales, known.log_scales) and np.array_equal(again.sh, known.sh)


@pytest.mark.parametrize("matrix, degree", [(np.diag([1.0, 1, -1]), 0), (2 * np.eye(3), 0), (ANY, 1)])
def test_a_mirror_a_scale_or_colours_that_depend_on_the_view_are_refused(matrix, degree):
    with pytest.raises(ValueError, match="proper rotation"):
        turn_field(random_field(3, degree=degree), matrix)


def test_rims_touch_the_box_and_do_not_leave_it(tmp_path, monkeypatch):
    monkeypatch.setattr(spool, "CHUNK", 7)  # several parts
    field = random_field(20, seed=2)
    with Spool(tmp_path / "spool") as placed:
        placed.append(field)
    low, high = placed.find_box()
    ball = np.random.default_rng(0).normal(size=(20_000, 3))
    ball *= RIM / np.linalg.norm(ball, axis=1, keepdims=True)
    turns = Rotation.from_quat(field.quats, scalar_first=True).as_matrix()
    rims = np.concatenate(
        [m + (ball * np.exp(s)) @ r.T for m, s, r in zip(field.means, field.log_scales, turns, strict=True)]
    )
    assert (rims >= low - 1e-4).all() and (rims <= high + 1e-4).all()
    np.testing.assert_allclose([rims.min(0), rims.max(0)], [low, high], atol=0.02 * np.ptp(rims))
