import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.reconstruction import external_field

MAX_GAUSSIANS = 20_000
FRAME = scene_frame(
    kind="field", unit="metre", flying_height=5.0, exemplar=(0.0, 0.0, 4.0), extent=(0.0, 0.0, 4.0, 4.0)
)


def test_the_surface_under_a_finished_field_is_found_and_what_lies_beyond_is_cut_off():
    rng = np.random.default_rng(0)
    xy = rng.uniform(-1, 5, (30_000, 2))
    n = len(xy)
    field = GaussianField(
        np.column_stack([xy, 0.3 + 0.1 * xy[:, 0]]).astype(np.float32),
        np.full((n, 3), np.log(0.05), np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, 3.0, np.float32),
        rgb_to_sh(np.full((n, 3), 0.5)),
        np.zeros(n, np.float32),
        np.ones(n, bool),  # as if it came from a ground layer of ours
    )
    inside, grid = external_field.prepare_external_field(field, FRAME, MAX_GAUSSIANS)
    assert 0 < len(inside) < n and not inside.ground.any()
    assert inside.means[:, :2].min() >= 0 and inside.means[:, :2].max() <= 4
    x = grid.centres[:, 0].reshape(grid.shape)
    # the topmost of overlapping round Gaussians is seen, up to a standard deviation above the surface
    assert np.abs(grid.heights - (0.3 + 0.1 * x)).max() < 0.06
    assert grid.spacing == pytest.approx(0.05 / external_field.WIDTH)
