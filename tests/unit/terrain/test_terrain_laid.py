import numpy as np
import pytest

from dav_gswt import cameras
from dav_gswt.coarse import discs, ground
from dav_gswt.terrain import assemble, still
from dav_gswt.terrain.choice import tile_at

SKY = {"zenith": [0.3, 0.5, 0.9], "horizon": [0.8, 0.85, 0.9]}


@pytest.fixture(scope="module")
def terrain():
    """Sixteen tiles of one colour each, 4 units wide, at two levels."""
    frame = {
        "exemplar": {"west": 0.0, "south": 0.0, "side": 4.0},
        "extent": {"west": 0.0, "south": 0.0, "east": 4.0, "north": 4.0},
    }
    tiles = {}
    for level, spacing in enumerate((0.125, 0.25)):
        grid = ground.lay(frame, np.zeros((0, 3)), spacing, 10**6, block=16, margin=0.0)
        for tile in range(16):
            colour = np.tile([0.2 + tile / 32, 0.5, 0.3], (grid.heights.size, 1))
            tiles[level, tile] = discs.ground_discs(grid, colour)
    return assemble.Terrain(tiles, 4.0, [20.0, np.inf], 1, 7)


def test_levels_follow_the_distance_and_cells_come_nearest_first(terrain):
    camera = cameras.pinhole([2.0, 2, 3], [10, 10, 0], 64, 36, 60.0)
    cells = assemble.visible(terrain, camera)
    far = [np.hypot(4 * i + 2 - 2, 4 * j + 2 - 2) for i, j, _ in cells]
    assert {level for *_, level in cells} == {0, 1}
    assert all(level == 0 for d, (*_, level) in zip(far, cells, strict=True) if d < 14)
    assert all(level == 1 for d, (*_, level) in zip(far, cells, strict=True) if d > 26)


def test_what_the_camera_sees_is_there(terrain):
    """Against the slow way: every cell whose ground a ray through some pixel meets is among the visible."""
    camera = cameras.pinhole([2.0, 2, 3], [10, 7, 0], 48, 27, 60.0)
    origin, step = camera.rays()
    down = step[..., 2] < -0.05
    at = origin[down] - step[down] * (origin[down][:, 2:] / step[down][:, 2:])
    met = {tuple(c) for c in np.floor(at[:, :2] / 4).astype(int).tolist()}
    assert met <= {(i, j) for i, j, _ in assemble.visible(terrain, camera)}


def test_a_place_is_the_same_on_every_visit_and_far_out_too(terrain):
    far = 10**6
    cells = [(far, -far, 0)]
    here = assemble.laid(terrain, cells, np.array([far * 4.0, -far * 4.0, 0]))
    tile = terrain.tiles[0, tile_at(far, -far, 7, 1)]
    np.testing.assert_array_equal(here.means, tile.means)  # relative to the eye nothing is rounded


@pytest.mark.parametrize("shot", still.SHOTS, ids=lambda shot: shot.name)
def test_stills_have_ground_below_and_sky_above(terrain, shot):
    camera = still.camera_of(shot, terrain.side, 3.0, 96, 54)
    picture = still.draw(terrain, camera, SKY, [0.45, 0.5, 0.3])
    assert picture.shape == (54, 96, 3)
    assert np.isfinite(picture).all()
    np.testing.assert_allclose(picture[-4:, :, 1:], np.broadcast_to([0.5, 0.3], (4, 96, 2)), atol=0.03)
    if shot.pitch < 20:
        assert (picture[0, :, 2] > 0.6).all()
