"""Splats of other programs are read as their formats describe them, or named with the command that converts them."""

import gzip
import re
from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from fixtures.splat_files import read_spz

from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_UP, turn_field
from dav_gswt.export.splat_files import write_spz
from dav_gswt.export.spool import Spool
from dav_gswt.photos.importers.splat_files import read_splat


@pytest.fixture
def field():
    given = random_field(300, seed=3)
    return replace(given, log_scales=given.log_scales - 3, sh=0.5 * given.sh)


@pytest.fixture(params=[2, 3])
def spz(request, field, tmp_path):
    with Spool(tmp_path / "spool") as spool:
        spool.append(field)
    write_spz(spool, tmp_path / "a.spz", request.param)
    return tmp_path / "a.spz"


def test_an_spz_is_read_as_a_second_reader_does(spz, field):
    splats, other = read_splat(spz), read_spz(spz)
    read = splats.field
    np.testing.assert_allclose(read.means, other.means, atol=1e-6)
    np.testing.assert_allclose(read.means, turn_field(field, Y_UP).means, atol=1e-3)
    np.testing.assert_allclose(read.log_scales, other.log_scales, atol=1e-6)
    np.testing.assert_allclose(read.sh, other.sh, atol=1e-5)
    np.testing.assert_allclose(np.abs((read.quats * other.quats).sum(1)), 1, atol=1e-2)  # 3 bytes a rotation
    seen = np.abs(read.opacity_logits) < 16
    np.testing.assert_allclose(read.opacity_logits[seen], other.opacity_logits[seen], atol=1e-4)
    assert splats.sh_degree == 0 and not splats.origin.any()


def test_an_spz_of_version_1_has_half_precision_places(tmp_path):
    places = np.array([[1.5, -2, 0.25], [7, 0, -8]], "<f2")
    header = np.array([0x5053474E, 1, 2], "<u4").tobytes() + bytes([1, 0, 0, 0])
    columns = places.tobytes() + bytes([255, 0]) + bytes(6) + bytes([160] * 6) + bytes([128] * 6) + bytes(18)
    (tmp_path / "a.spz").write_bytes(gzip.compress(header + columns))
    splats = read_splat(tmp_path / "a.spz")
    assert splats.field.means.tolist() == places.tolist() and splats.sh_degree == 1
    assert splats.field.opacity_logits.tolist() == [16, -16] and not splats.field.log_scales.any()


def test_what_is_cut_short_or_announces_too_much_is_refused(spz, tmp_path):
    whole = gzip.decompress(spz.read_bytes())
    more = whole[:8] + np.uint32(99_000_000).tobytes() + whole[12:]
    files = {"a.spz": spz.read_bytes()[:-40], "b.spz": gzip.compress(whole[:-9]), "c.spz": gzip.compress(more)}
    files |= {"d.spz": gzip.compress(b"other" * 9)}
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=re.escape(name)):
            read_splat(tmp_path / name)
    with pytest.raises(InputError, match="g.spz: there is no such file"):
        read_splat(tmp_path / "g.spz")


@pytest.mark.parametrize(
    "name, data, kind",
    [
        ("a b.ksplat", bytes(99), "a .ksplat"),
        ("b.splat", bytes(64), "a .splat"),
        ("a.spz", b"NGSP" + bytes(40), "an SPZ of version 4"),
    ],
)
def test_kinds_that_are_not_read_are_named_with_the_command_that_converts_them(tmp_path, name, data, kind):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(
        InputError, match=f"is {re.escape(kind)}.*convert it: npx @playcanvas/splat-transform .*{name}'? .*ply"
    ):
        read_splat(tmp_path / name)
