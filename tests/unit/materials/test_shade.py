import numpy as np
import pytest

from dav_gswt.materials import objects


@pytest.mark.parametrize(
    ("ratio", "shaded"), [((0.3, 0.35, 0.45), True), ((0.3, 0.3, 0.2), False), ((0.9, 0.9, 1.0), False)]
)
def test_shade_is_darker_and_bluer(ratio, shaded):
    light = np.array([0.5, 0.4, 0.3])
    assert objects.is_shade(light * ratio, light) == shaded
    np.testing.assert_allclose(objects.linear_light(np.full((2, 3), 0.5)), 0.21404114, rtol=1e-6)


def test_dapples_beside_larger_shade_are_found_and_shade_that_is_everywhere_is_texture():
    ground, dark = np.ones((100, 100), bool), np.array([0.5, 0.55, 0.65])
    colour = np.full((100, 100, 3), 0.6)
    colour[20:40, 20:30] *= dark
    colour[70:90, 60:70] *= dark
    beside = np.zeros((100, 100), bool)
    beside[20:40, 32:60] = True
    shaded = objects.find_shade(colour, ground & ~beside, beside)
    assert shaded[22:38, 22:28].all() and not shaded[60:].any()
    assert not objects.find_shade(colour, ground, ~ground).any()
    assert not objects.find_shade(colour, ~ground, beside).any()
    stripes = np.full((100, 100, 3), 0.6)
    stripes[:, np.arange(100) % 6 < 2] *= [0.5, 0.55, 0.65]
    beside = np.zeros((100, 100), bool)
    beside[:4] = True
    assert not objects.find_shade(stripes, ~beside, beside).any()
