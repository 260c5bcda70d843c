"""SPZ: what is written is what the format's description says, in both versions."""

import gzip
from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from fixtures.splat_files import read_spz

from dav_gswt.export import spz
from dav_gswt.export.axes import Y_UP, turn_field
from dav_gswt.export.spool import Spool
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render


@pytest.fixture(scope="module")
def field():
    field = random_field(400, seed=3)
    return replace(field, log_scales=field.log_scales - 3, sh=0.5 * field.sh)


@pytest.fixture
def spool(field, tmp_path):
    with Spool(tmp_path / "spool") as spool:
        for rows in np.split(np.arange(len(field)), [100, 101]):
            spool.append(field[rows])
    return spool


@pytest.mark.parametrize("version, angle", [(2, 12.0), (3, 0.3)])
def test_every_column_comes_back_within_its_step(field, spool, tmp_path, version, angle):
    spz.write_spz(spool, tmp_path / "a.spz", version)
    read, wanted = read_spz(tmp_path / "a.spz"), turn_field(field, Y_UP)
    finest = np.exp(field.log_scales).mean() / spz.FINER
    assert np.abs(read.means - wanted.means).max() <= finest / 2 + 1e-6
    assert np.abs(read.log_scales - wanted.log_scales).max() <= 0.5 / 16 + 1e-6
    assert np.abs(read.sh - wanted.sh).max() <= 0.5 / 255 / 0.15 + 1e-6
    alpha, expected = (1 / (1 + np.exp(-f.opacity_logits)) for f in (read, wanted))
    assert np.abs(alpha - expected).max() <= 0.5 / 255 + 1e-6
    cosine = np.abs((read.quats * wanted.quats).sum(1)) / np.linalg.norm(read.quats, axis=1)
    assert np.degrees(2 * np.arccos(np.minimum(cosine, 1))).max() < angle


@pytest.mark.parametrize("version", spz.VERSIONS)
def test_it_looks_the_same(field, spool, tmp_path, version):
    spz.write_spz(spool, tmp_path / "a.spz", version)
    back = turn_field(read_spz(tmp_path / "a.spz"), Y_UP.T)
    camera = cameras.pinhole(np.array([3.0, -8.0, 4.0]), np.zeros(3), 96, 96, 50.0)
    shown, wanted = (render(f, camera, 0.5).colour for f in (back, field))
    assert psnr(shown, wanted, np.ones((96, 96))) > 38


def test_the_same_gaussians_give_the_same_bytes(spool, tmp_path):
    for name in ("a", "b"):
        spz.write_spz(spool, tmp_path / f"{name}.spz")
    assert (tmp_path / "a.spz").read_bytes() == (tmp_path / "b.spz").read_bytes()


def test_a_wide_terrain_gives_bits_after_the_point_for_those_before_it(field, tmp_path):
    with Spool(tmp_path / "wide") as wide:
        wide.append(field)
        far = field[:1]
        far.means[:] = [30_000, -30_000, 0]
        wide.append(far)
    spz.write_spz(wide, tmp_path / "a.spz")
    assert gzip.decompress((tmp_path / "a.spz").read_bytes())[13] == 8
    np.testing.assert_allclose(read_spz(tmp_path / "a.spz").means[-1], [30_000, 0, 30_000], atol=2**-8)


@pytest.mark.parametrize("version, count", [(4, 5), (3, 0), (3, spz.MAX_GAUSSIANS + 1)])
def test_what_the_format_cannot_hold_is_not_written(spool, tmp_path, version, count):
    spool.count = count
    with pytest.raises(ValueError, match="is not written"):
        spz.write_spz(spool, tmp_path / "a.spz", version)
    assert not (tmp_path / "a.spz").exists()


def test_colours_that_depend_on_the_view_are_refused(tmp_path):
    with Spool(tmp_path / "s") as spool, pytest.raises(ValueError, match="degree 0"):
        spool.append(random_field(3, degree=1))
