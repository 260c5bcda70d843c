"""Blocks: bytes by hand, round trips of any values, zigzag."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dav_gswt.bundle.blocks import PLANES, Block, pack_block, unpack_block

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


@given(st.integers(0, 40).flatmap(blocks_of))
def test_records_have_clipped_colours_and_all_else_as_it_is(block):
    rows = block.to_records()
    assert len(rows.tobytes()) == 16 * len(block)
    np.testing.assert_array_equal(rows["rgba"][:, :3], np.clip(block.colours, 0, 255))
    back = Block.from_records(rows)
    for name in ("position", "scale", "rotation", "opacity"):
        np.testing.assert_array_equal(getattr(back, name), getattr(block, name))
    assert unpack_block(pack_block(back)).to_records().tobytes() == rows.tobytes()
