"""The one interface: a field, a camera, a background."""

import numpy as np
from fixtures.raster_scenes import CAMERAS, gaussians

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.raster import harmonics, render


def field(n: int = 100, degree: int = 0) -> GaussianField:
    arrays = gaussians(n)
    sh = np.concatenate(
        [
            rgb_to_sh(arrays["colours"]),
            0.2 * gaussians(n, channels=3 * ((degree + 1) ** 2 - 1))["colours"].reshape(n, -1, 3),
        ],
        axis=1,
    )
    names = ("means", "log_scales", "quats", "opacity_logits")
    return GaussianField(*(arrays[k] for k in names), sh.astype(np.float32), np.zeros(n, np.float32), np.zeros(n, bool))


def test_the_picture_is_linear_in_the_background():
    camera = CAMERAS["pinhole"]
    black, grey, red, both = (
        render(field(), camera, background).colour for background in (0.0, 0.25, (1, 0, 0), (1.25, 0.25, 0.25))
    )
    np.testing.assert_allclose(grey + red - black, both, atol=1e-6)
    alpha = render(field(), camera).alpha
    np.testing.assert_allclose((red - black)[..., 0], 1 - alpha, atol=1e-6)


# --- spherical harmonics


def test_harmonics_are_orthonormal_over_the_sphere():
    # Gauss-Legendre in z, even steps in azimuth: exact for the products of degree 6
    z, weight = np.polynomial.legendre.leggauss(8)
    azimuth = np.arange(16) * np.pi / 8
    r = np.sqrt(1 - z**2)
    directions = np.stack([np.outer(r, np.cos(azimuth)), np.outer(r, np.sin(azimuth)), np.outer(z, np.ones(16))], -1)
    values = harmonics.basis(directions.reshape(-1, 3), 3)
    area = np.repeat(weight * np.pi / 8, 16)
    np.testing.assert_allclose(values.T @ (area[:, None] * values), np.eye(16), atol=1e-12)


def test_harmonics_have_the_signs_that_3dgs_gives_them():
    # looking along +x, +y, +z: degree 1 is (-y, z, -x) sqrt(3 / 4 pi)
    c = np.sqrt(3 / (4 * np.pi))
    np.testing.assert_allclose(harmonics.basis(np.eye(3), 1)[:, 1:], [[0, 0, -c], [-c, 0, 0], [0, c, 0]], atol=1e-15)
