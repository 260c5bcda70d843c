import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import plane_sweep
from dav_gswt.reconstruction.ground import Ground

TALL = 0.5
BOX = (1.2, 2.0)  # from, to, in x and y


def texture(x, y, seed):
    """A smooth random look of a plane."""
    rng = np.random.default_rng(seed)
    out = np.zeros((*np.shape(x), 3))
    for _ in range(24):
        k, phase, colour = rng.uniform(-14, 14, 2), rng.uniform(0, 7), rng.uniform(-0.12, 0.12, 3)
        out += np.sin(k[0] * x + k[1] * y + phase)[..., None] * colour
    return np.clip(0.5 + out, 0, 1)


def meet(camera, z):
    """Where its rays meet a height."""
    origin, step = camera.rays()
    t = (z - origin[..., 2]) / step[..., 2]
    return origin[..., 0] + t * step[..., 0], origin[..., 1] + t * step[..., 1]


def photo(eye, size=96):
    """A table of height TALL over textured ground, as rays see it from above."""
    camera = cameras.pinhole(eye, [1.6, 1.6, 0.0], size, size, 50.0)
    x, y = meet(camera, TALL)
    top = (x > BOX[0]) & (x < BOX[1]) & (y > BOX[0]) & (y < BOX[1])
    image = np.where(top[..., None], texture(x, y, 1), texture(*meet(camera, 0.0), 2)).astype(np.float32)
    return TrainingView(str(eye), camera, image, np.ones((size, size), np.float32))


@pytest.fixture(scope="module")
def photos():
    return [photo([1.6 + dx, 1.6 + dy, 4.0]) for dx, dy in [(0, 0), (0.9, 0), (-0.9, 0), (0, 0.9), (0, -0.9)]]


@pytest.fixture(scope="module")
def found(photos) -> plane_sweep.Relief:
    return plane_sweep.sweep_heights(made.grid(0.05), photos, flying_height=4.0, pixel=0.04)


def inner(grid: Ground, low: float, high: float):
    x, y = (grid.centres[:, k].reshape(grid.shape) for k in (0, 1))
    return (x > low) & (x < high) & (y > low) & (y < high)


def test_what_stands_is_found_where_it_stands_and_as_high_as_it_is_and_the_ground_around_stays_ground(found):
    top = inner(found.grid, BOX[0] + 0.1, BOX[1] - 0.1)
    assert found.stands[top].mean() > 0.95
    # a step of the sweep: half of it by the parabola, as much again by the window
    assert np.median(np.abs(found.above[top] - TALL)) < found.step
    around = inner(found.grid, 0.4, 2.8) & ~inner(found.grid, BOX[0] - 0.25, BOX[1] + 0.25)
    assert found.stands[around].mean() < 0.01
    assert np.abs(found.above[around]).max() <= 2 * found.step


def test_on_ground_that_fewer_than_two_photos_see_nothing_stands(photos):
    alone = plane_sweep.sweep_heights(made.grid(0.1), photos[:1], flying_height=4.0, pixel=0.08)
    assert not alone.stands.any() and not alone.above.any()
