"""What must not break a renderer: finite everywhere, or a clear error."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import NAMES, camera, cloud, one

from dav_gswt import cameras
from dav_gswt.raster import cpu, render
from dav_gswt.raster import torch as twin

FORWARD = cameras.Camera(np.eye(3), np.zeros(3), 50.0, 50.0, 16.0, 16.0, 32, 32)  # at the origin, looking along z


def drawn(values, view=FORWARD, **options):
    raster = cpu.Rasterizer(**options)
    seen = raster.forward(*values, view)
    by = np.ones((view.height, view.width, 3), np.float32)
    gradients = raster.backward(by, by[..., 0].copy(), by[..., 0].copy())
    for name, array in {**vars(seen), **vars(gradients)}.items():
        assert np.isfinite(array).all(), name
    return seen


@pytest.mark.parametrize("z, shown", [(-1.0, False), (0.0, False), (1e-8, False), (0.0099, False), (0.0101, True)])
def test_nothing_nearer_than_the_near_plane_is_drawn(z, shown):
    assert (drawn(one(mean=(0, 0, z), sigma=0.001)).alpha.max() > 0) == shown


def test_opacity_0_is_the_same_as_not_there():
    values, view = cloud(50), camera()
    none = one()
    none[3][:] = -200
    with_it = [np.concatenate(v) for v in zip(values, none, strict=True)]
    np.testing.assert_array_equal(drawn(values, view).colour, drawn(with_it, view).colour)


def test_opacity_1_is_clamped_and_finite():
    solid = one(mean=(0, 0, 1), sigma=0.3)
    solid[3][:] = 1e4
    assert drawn(solid).alpha.max() == pytest.approx(0.99)


@pytest.mark.parametrize("sigma", [1e-12, 1e-6, 1e3, 1e6])
def test_tiny_and_huge_scales_are_finite_and_equal_the_twins(sigma):
    values = one(mean=(0.01, 0, 2), sigma=sigma)
    seen = drawn(values)
    np.testing.assert_allclose(seen.alpha, twin.forward(*values, FORWARD).alpha, atol=1e-5)


@pytest.mark.parametrize("thick", [0, 1, 2])
def test_needles_are_finite(thick):
    needle = one(mean=(0, 0, 2))
    needle[1][:] = np.log(1e-5)
    needle[1][0, thick] = np.log(10.0)
    needle[2][:] = [0.9, 0.2, -0.3, 0.1]
    assert drawn(needle).alpha.max() <= 0.99


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_named_with_their_index(name, value):
    values = cloud(20)
    values[NAMES.index(name)].reshape(20, -1)[7, 0] = value
    with pytest.raises(ValueError, match=rf"{name}: the value at \(7"):
        cpu.Rasterizer().forward(*values, camera())


def test_a_zero_quaternion_is_named():
    values = cloud(20)
    values[2][7] = 0
    with pytest.raises(ValueError, match="Gaussian 7"):
        cpu.Rasterizer().forward(*values, camera())


def test_an_array_that_is_not_contiguous_is_named():
    values = cloud(20)
    with pytest.raises(ValueError, match="log_scales: C-contiguous"):
        cpu.Rasterizer().forward(values[0], np.asfortranarray(values[1]), *values[2:], camera())


def test_an_empty_field_gives_an_empty_picture():
    assert not drawn([v[:0] for v in cloud(5)]).alpha.any()


finite = st.floats(-50, 50, width=32)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(finite, finite, finite, st.floats(-28, 14), st.floats(-28, 14), st.floats(-30, 30)), max_size=8)
)
def test_any_finite_field_gives_a_finite_picture(rows):
    rows = np.array(rows, np.float32).reshape(-1, 6)
    n = len(rows)
    values = [
        rows[:, :3].copy(),
        np.column_stack([rows[:, 3], rows[:, 4], rows[:, 3]]).astype(np.float32),
        np.tile(np.array([0.7, 0.1, -0.5, 0.3], np.float32), (n, 1)),
        rows[:, 5].copy(),
        np.full((n, 3), 0.5, np.float32),
    ]
    seen = drawn(values)
    assert seen.alpha.min() >= 0 and seen.alpha.max() <= 1


def test_a_picture_is_linear_in_its_background():
    from dav_gswt.field import Field, sh_of

    means, log_scales, quats, logits, colours = cloud(50)
    field = Field(means, log_scales, quats, logits, sh_of(colours), np.zeros(50, np.float32), np.zeros(50, bool))
    black, white = render(field, camera()), render(field, camera(), (1, 1, 1))
    grey = render(field, camera(), (0.25, 0.25, 0.25))
    np.testing.assert_allclose(grey.colour, 0.75 * black.colour + 0.25 * white.colour, atol=1e-6)
    oracle = render(field, camera(), (1, 1, 1), backend="torch")
    np.testing.assert_allclose(white.colour, oracle.colour, atol=2e-4)
    with pytest.raises(ValueError, match="backend"):
        render(field, camera(), backend="opengl")
