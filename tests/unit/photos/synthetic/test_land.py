"""What the families share."""

import numpy as np

from dav_gswt.photos.synthetic import land


def test_mounds_add_up_and_end():
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-3, 3, (2, 40, 30))
    z, plants = rng.normal(size=x.shape), np.column_stack([rng.uniform(-2, 2, (9, 2)), rng.uniform(0.1, 0.5, 9)])
    expected = z.copy()
    for px, py, size in plants:
        square = (x - px) ** 2 + (y - py) ** 2
        mound = 0.2 * size * np.exp(-square / (0.7 * size) ** 2)
        expected += np.where(np.abs(x - px) + np.abs(y - py) < 3 * size, mound, 0)
    before = z.copy()
    assert np.allclose(land.add_mounds(z, x, y, plants, height=0.2, width=0.7, end=3.0), expected, rtol=0, atol=1e-12)
    assert np.array_equal(z, before)


def test_without_plants_the_heights_stay():
    z = np.random.default_rng(1).normal(size=(4, 5))
    assert np.array_equal(land.add_mounds(z, z, z, np.zeros((0, 3)), height=0.2, width=0.7, end=3.0), z)
