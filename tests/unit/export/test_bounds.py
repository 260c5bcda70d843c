"""The box of a spool's Gaussians: tight about their rims, along any axes."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from scipy.spatial.transform import Rotation

from dav_gswt.export import spool
from dav_gswt.export.axes import AXES, Z_UP
from dav_gswt.export.bounds import find_box, unite_boxes
from dav_gswt.export.spool import Spool
from dav_gswt.raster.interface import RIM


@pytest.mark.parametrize("axes", list(AXES))
def test_rims_touch_the_box_and_do_not_leave_it(tmp_path, monkeypatch, axes):
    monkeypatch.setattr(spool, "CHUNK", 7)  # several parts
    field = random_field(20, seed=2)
    with Spool(tmp_path / "spool") as placed:
        placed.append(field)
    low, high = find_box(placed, AXES[axes])
    ball = np.random.default_rng(0).normal(size=(20_000, 3))
    ball *= RIM / np.linalg.norm(ball, axis=1, keepdims=True)
    turns = Rotation.from_quat(field.quats, scalar_first=True).as_matrix()
    rims = np.concatenate(
        [m + (ball * np.exp(s)) @ r.T for m, s, r in zip(field.means, field.log_scales, turns, strict=True)]
    )
    rims = rims @ AXES[axes].T
    assert (rims >= low - 1e-4).all() and (rims <= high + 1e-4).all()
    np.testing.assert_allclose([rims.min(0), rims.max(0)], [low, high], atol=0.02 * np.ptp(rims))


def test_nothing_has_no_box(tmp_path):
    with Spool(tmp_path / "spool") as placed:
        placed.append(replace(random_field(3))[np.zeros(3, bool)])
    with pytest.raises(ValueError, match="no box"):
        find_box(placed, Z_UP)


def test_a_union_holds_its_parts():
    boxes = [(np.zeros(3), np.array([1.0, 2, 3])), (np.array([-1.0, 1, 1]), np.array([0.5, 4, 2]))]
    np.testing.assert_array_equal(unite_boxes(boxes), [[-1, 0, 0], [1, 4, 3]])
