"""Sixteen bytes and blocks: values by hand, errors as stated, equal places across borders, round trips."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.bundle.encoding import Encoding, find_smallest_rotations
from dav_gswt.bundle.parts import PLANES, Block, pack_block, unpack_block
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh

SIDE, PIXEL = 2.0, 1e-3


def field_of(means, deviations, quats=None, opacities=0.5, colours=0.5):
    n = len(means)
    opacities = np.broadcast_to(np.asarray(opacities, float), n)
    with np.errstate(divide="ignore"):
        logits = np.clip(np.log(opacities) - np.log1p(-opacities), -1e3, 1e3)
    return GaussianField(
        np.float32(means),
        np.log(np.float32(deviations)),
        np.float32(np.tile([1, 0, 0, 0], (n, 1)) if quats is None else quats),
        logits.astype(np.float32),
        rgb_to_sh(np.broadcast_to(np.float32(colours), (n, 3))),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def covariance(quats, log_scales):
    axes = Rotation.from_quat(quats.astype(float), scalar_first=True).as_matrix()
    axes = axes * np.exp(log_scales.astype(float))[:, None]
    return axes @ axes.transpose(0, 2, 1)


def test_a_splat_is_stored_as_its_16_bytes():
    # a quarter turn about z is none with x and y swapped
    turned = field_of([[0.5, 2, 3]], [[np.exp(-2), 1, np.exp(-1)]], [[-2, 0, 0, 2]], 0.5, [[1, 0.5, 0]])
    corners = field_of([[0, 0, 1], [2, 2, 5]], np.exp([[-2.0] * 3, [0.0] * 3]))
    coding = Encoding.fit([turned, corners], SIDE, PIXEL)
    assert coding.origin == [0, 0, 1] and coding.step == [2 / 65535, 2 / 65535, pytest.approx(4 / 65535)]
    assert coding.log_scale == [pytest.approx(-2), pytest.approx(2 / 255)]
    # 0.5 of 2: 16383.75, the top, half-way up (to even); 0, -2, -1 of -2 to 0; identity; 255, 127.5 to even, 0, 127.5
    expected = np.uint16([16384, 65535, 32768]).astype("<u2").tobytes() + bytes([255, 0, 128])
    expected += bytes([127, 127, 127]) + bytes([255, 128, 0, 128])
    assert coding.encode(turned).tobytes() == expected
    back = coding.decode(coding.encode(turned))
    np.testing.assert_allclose(
        covariance(back.quats, back.log_scales)[0], np.diag([1, np.exp(-4), np.exp(-2)]), rtol=0.01
    )


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 40),
    st.sampled_from([0.0, 1e-6, 1.0, 1e3]),
    st.sampled_from([(-12, -12), (-12, 6), (-2, 0), (6, 6)]),
)
def test_what_is_read_back_errs_no_more_than_is_stated(seed, count, height, sizes):
    """Heights that are all equal or kilometres, sizes from 1e-12 to 1e6, opacities 0 and 1 included."""
    rng = np.random.default_rng(seed)
    means = rng.uniform(-0.1, 1.1, (count, 3)) * [SIDE, SIDE, height]
    deviations = 10 ** rng.uniform(*sizes, (count, 3))
    opacities = rng.choice([0.0, 1.0, 0.3, rng.random()], count)
    field = field_of(means, deviations, rng.normal(size=(count, 4)), opacities, rng.uniform(-0.2, 1.2, (count, 3)))
    coding = Encoding.fit([field], SIDE, PIXEL)
    rows = coding.encode(field)
    back = coding.decode(rows)
    assert all(
        np.isfinite(getattr(back, name)).all() for name in ("means", "log_scales", "quats", "opacity_logits", "sh")
    )
    # half a step of the grid either way, and a float32's last digit
    room = 0.5 * np.array(coding.step) + 1e-7 * np.abs(field.means).max(0) + 1e-12
    away = np.abs(back.means.astype(float) - field.means)
    assert (away <= room).all()
    rotation, axes = find_smallest_rotations(field.quats)
    exact, read = (Rotation.from_quat(q.astype(float), scalar_first=True) for q in (rotation, back.quats))
    assert np.degrees((exact.inv() * read).magnitude()).max() <= 0.38
    wanted = np.take_along_axis(field.log_scales.astype(float), axes, 1)
    low, high = np.log(PIXEL / 64), np.log(4 * SIDE)
    assert (np.abs(np.clip(wanted, low, high) - back.log_scales) <= 0.5 * coding.log_scale[1] + 1e-5).all()
    assert np.abs(back.base_colours - np.clip(field.base_colours, 0, 1)).max() <= 0.5 / 255 + 1e-6
    assert np.abs(rows["rgba"][:, 3] / 255 - expit(field.opacity_logits)).max() <= 0.5 / 255 + 1e-6


def test_gaussians_that_meet_across_a_border_are_moved_alike():
    """A Gaussian that sticks out of a tile, and its neighbours', are on one grid of which a side is a whole part."""
    rng = np.random.default_rng(3)
    means = rng.uniform(-0.2, SIDE + 0.3, (500, 3))
    here = field_of(means, np.full((500, 3), 0.1))
    beside = field_of(means - [SIDE, 0, 0], np.full((500, 3), 0.1))
    coding = Encoding.fit([here, beside], SIDE, PIXEL)
    assert SIDE / coding.step[0] == pytest.approx(round(SIDE / coding.step[0]), abs=1e-9)
    left, right = (coding.decode(coding.encode(field)).means.astype(float) for field in (here, beside))
    moved = np.abs(left - [SIDE, 0, 0] - right).max(1)
    # equal but where float32 rounds the source to the other side of half a step
    assert (moved < 1e-6).mean() > 0.98 and moved.max() <= coding.step[0] + 1e-6


@pytest.mark.parametrize("cells, steps", [(8, 1024), (24, 24 * 43), (32, 1024), (48, 48 * 32), (400, 400 * 32)])
def test_a_cell_of_a_composed_tile_is_a_whole_number_of_steps_of_which_a_tile_has_enough(cells, steps):
    field = field_of([[-0.7, 0, 0], [SIDE, SIDE, 0.5]], np.full((2, 3), 0.1))
    coding = Encoding.fit([field], SIDE, PIXEL, cells)
    assert coding.step[:2] == [pytest.approx(SIDE / steps)] * 2 and coding.step[2] == pytest.approx(SIDE / steps / 2)
    west = -coding.origin[0] / coding.step[0]
    assert west == pytest.approx(round(west), abs=1e-9) and coding.origin[0] <= -0.7
    with pytest.raises(InputError, match="100 tile sides"):
        Encoding.fit([field_of([[1, 1, 0], [201, 1, 0]], np.full((2, 3), 0.1))], SIDE, PIXEL, cells)


ENDS = {np.uint8: (0, 255), np.uint16: (0, 1, 32767, 32768, 65534, 65535), np.int16: (-32768, -1, 0, 1, 32767)}


def values(kind, shape):
    """Arrays in which the ends of the range are common."""
    info = np.iinfo(kind)
    return arrays(kind, shape, elements=st.sampled_from(ENDS[kind]) | st.integers(info.min, info.max))


def blocks_of(count):
    shapes = [(np.uint16, (count, 3)), (np.uint8, (count, 3)), (np.uint8, (count, 3)), (np.int16, (count, 3))]
    return st.builds(Block, *(values(*each) for each in shapes), values(np.uint8, count))


def test_a_block_is_stored_as_its_planes():
    place = np.array([[1, 0x203, 5], [0xFFFF, 0, 3]], np.uint16)
    scale, rotation = np.array([[[10, 11, 12], [20, 21, 22]], [[30, 31, 32], [40, 41, 42]]], np.uint8)
    colours = np.array([[7, 5, 4], [-2, -1, 299]], np.int16)
    block = Block(place, scale, rotation, colours, np.array([250, 251], np.uint8))
    planes = [[1, 0xFF], [0, 0xFF], [3, 0], [2, 0], [10, 3], [0, 0]]  # z: 5, -2
    planes += [[10, 20], [11, 21], [12, 22], [30, 40], [31, 41], [32, 42]]
    planes += [[5, 0xFF], [0, 0xFF], [4, 1], [0, 0], [1, 0x58], [0, 0x02], [250, 251]]  # 2, -1; -1, 300
    assert pack_block(block) == bytes(sum(planes, []))


@given(st.integers(0, 40).flatmap(blocks_of))
def test_any_block_reads_back(block):
    data = pack_block(block)
    assert len(data) == PLANES * len(block)
    back = unpack_block(data)
    for name, own in vars(block).items():
        found = getattr(back, name)
        assert found.dtype == own.dtype
        np.testing.assert_array_equal(found, own, name)
