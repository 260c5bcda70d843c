"""GLB and SPZ: Gaussians as the formats' descriptions have them, in parts; what does not fit is refused."""

import gzip
from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from fixtures.splat_files import read_glb, read_glb_splats, read_spz

from dav_gswt.export import glb, splat_files
from dav_gswt.export.axes import Y_UP, turn_field
from dav_gswt.export.formats import FORMATS
from dav_gswt.export.spool import Spool


@pytest.fixture
def file(placed, tmp_path):
    glb.write_splats(placed, tmp_path / "a.glb", {"unit": "metre"})
    return tmp_path / "a.glb"


def test_a_glb_has_every_gaussian_with_y_up_in_the_announced_size(field, file):
    read, wanted = read_glb_splats(file), turn_field(field, Y_UP)
    np.testing.assert_array_equal(read.means, wanted.means)
    np.testing.assert_array_equal(read.sh, wanted.sh)
    np.testing.assert_allclose(read.log_scales, wanted.log_scales, atol=1e-5)
    np.testing.assert_allclose(read.opacity_logits, wanted.opacity_logits, atol=1e-4)
    np.testing.assert_allclose(read.quats, wanted.quats, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(read.quats, axis=1), 1, atol=1e-6)
    assert 0 <= file.stat().st_size - len(field) * FORMATS["glb"].bytes <= 65_536


def test_other_programs_see_points_of_the_right_colour(field, file):
    document, values = read_glb(file)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    colours = values[attributes["COLOR_0"]] / 255
    encoded = np.where(colours <= 0.0031308, 12.92 * colours, 1.055 * colours ** (1 / 2.4) - 0.055)
    middle = (field.base_colours > 0.2) & (field.base_colours < 1)
    np.testing.assert_allclose(encoded[:, :3][middle], field.base_colours[middle], atol=0.02)
    np.testing.assert_allclose(colours[:, 3], 1 / (1 + np.exp(-field.opacity_logits)), atol=0.003)
    assert document["nodes"][0]["extras"] == {"unit": "metre"}
    position, colour = (document["accessors"][attributes[name]] for name in ("POSITION", "COLOR_0"))
    means = turn_field(field, Y_UP).means
    assert (position["min"], position["max"]) == (means.min(0).tolist(), means.max(0).tolist())
    assert colour["normalized"] and colour["componentType"] == 5121


@pytest.fixture(scope="module")
def small():
    """Gaussians smaller and greyer than those of `field`."""
    field = random_field(400, seed=3)
    return replace(field, log_scales=field.log_scales - 3, sh=0.5 * field.sh)


@pytest.fixture
def spool(small, tmp_path):
    with Spool(tmp_path / "spool") as spool:
        spool.append(small[:100])
        spool.append(small[100:])
    return spool


@pytest.mark.parametrize("version, angle", [(2, 12.0), (3, 0.3)])
def test_every_column_of_an_spz_is_within_its_step_and_the_same_each_time(small, spool, tmp_path, version, angle):
    for name in ("a", "b"):
        splat_files.write_spz(spool, tmp_path / f"{name}.spz", version)
    assert (tmp_path / "a.spz").read_bytes() == (tmp_path / "b.spz").read_bytes()
    read, wanted = read_spz(tmp_path / "a.spz"), turn_field(small, Y_UP)
    finest = np.exp(small.log_scales).mean() / splat_files.FINER
    assert np.abs(read.means - wanted.means).max() <= finest / 2 + 1e-6
    assert np.abs(read.log_scales - wanted.log_scales).max() <= 0.5 / 16 + 1e-6
    assert np.abs(read.sh - wanted.sh).max() <= 0.5 / 255 / 0.15 + 1e-6
    alpha, expected = (1 / (1 + np.exp(-f.opacity_logits)) for f in (read, wanted))
    assert np.abs(alpha - expected).max() <= 0.5 / 255 + 1e-6
    cosine = np.abs((read.quats * wanted.quats).sum(1)) / np.linalg.norm(read.quats, axis=1)
    assert np.degrees(2 * np.arccos(np.minimum(cosine, 1))).max() < angle


def test_a_wide_terrain_gives_bits_after_the_point_for_those_before_it(small, tmp_path):
    with Spool(tmp_path / "wide") as wide:
        wide.append(small)
        far = small[:1]
        far.means[:] = [30_000, -30_000, 0]
        wide.append(far)
    splat_files.write_spz(wide, tmp_path / "a.spz")
    assert gzip.decompress((tmp_path / "a.spz").read_bytes())[13] == 8
    np.testing.assert_allclose(read_spz(tmp_path / "a.spz").means[-1], [30_000, 0, 30_000], atol=2**-8)
