import numpy as np
import pytest

from dav_gswt.materials import shade


@pytest.mark.parametrize(
    ("ratio", "shaded"), [((0.3, 0.35, 0.45), True), ((0.3, 0.3, 0.2), False), ((0.9, 0.9, 1.0), False)]
)
def test_shade_is_darker_and_bluer(ratio, shaded):
    light = np.array([0.5, 0.4, 0.3])
    assert shade.is_shade(light * ratio, light) == shaded


def test_linear_light_is_that_of_srgb():
    np.testing.assert_allclose(shade.linear_light(np.full((2, 3), 0.5)), 0.21404114, rtol=1e-6)
