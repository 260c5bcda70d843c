"""GLBs: Gaussians as the ratified extension has them, in parts; lengths that do not fit are refused."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from fixtures.splat_files import read_glb, read_glb_splats

from dav_gswt.export import glb_splats
from dav_gswt.export.axes import Y_UP, turn_field
from dav_gswt.export.glb import GlbWriter
from dav_gswt.export.spool import Spool


@pytest.fixture
def file(placed, tmp_path):
    glb_splats.write_glb_splats(placed, tmp_path / "a.glb", {"unit": "metre"})
    return tmp_path / "a.glb"


def test_every_gaussian_is_there_with_y_up(field, file):
    read, wanted = read_glb_splats(file), turn_field(field, Y_UP)
    np.testing.assert_array_equal(read.means, wanted.means)
    np.testing.assert_array_equal(read.sh, wanted.sh)
    np.testing.assert_allclose(read.log_scales, wanted.log_scales, atol=1e-5)
    np.testing.assert_allclose(read.opacity_logits, wanted.opacity_logits, atol=1e-4)
    np.testing.assert_allclose(read.quats, wanted.quats, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(read.quats, axis=1), 1, atol=1e-6)


def test_other_programs_see_points_of_the_right_colour(field, file):
    document, values = read_glb(file)
    colours = values[document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]] / 255
    encoded = np.where(colours <= 0.0031308, 12.92 * colours, 1.055 * colours ** (1 / 2.4) - 0.055)
    middle = (field.base_colours > 0.2) & (field.base_colours < 1)
    np.testing.assert_allclose(encoded[:, :3][middle], field.base_colours[middle], atol=0.02)
    np.testing.assert_allclose(colours[:, 3], 1 / (1 + np.exp(-field.opacity_logits)), atol=0.003)
    assert document["nodes"][0]["extras"] == {"unit": "metre"}


def test_the_size_of_a_gaussian_is_what_limits_are_counted_with(field, file):
    assert (
        len(field) * glb_splats.BYTES <= file.stat().st_size <= len(field) * glb_splats.BYTES + glb_splats.HEADER_BYTES
    )


def test_a_file_beyond_32_bits_is_refused_before_it_is_begun(tmp_path):
    glb = GlbWriter({})
    glb.add([], 2**28, 4)
    with pytest.raises(ValueError, match="more than a GLB holds"):
        glb.write(tmp_path / "a.glb")
    assert list(tmp_path.iterdir()) == []


def test_parts_that_are_not_what_was_announced_leave_no_file(tmp_path):
    glb = GlbWriter({})
    glb.add([np.zeros((2, 3), np.float32)], 3, 3)
    with pytest.raises(ValueError, match="24 bytes where 36"):
        glb.write(tmp_path / "a.glb")
    assert list(tmp_path.iterdir()) == []


def test_opacities_stay_within_the_unit_interval(tmp_path):
    field = replace(random_field(3), opacity_logits=np.float32([-800, 0, 800]))
    with Spool(tmp_path / "spool") as placed, np.errstate(over="raise"):
        placed.append(field)
    glb_splats.write_glb_splats(placed, tmp_path / "a.glb", {})
    document, values = read_glb(tmp_path / "a.glb")
    which = document["meshes"][0]["primitives"][0]["attributes"]["KHR_gaussian_splatting:OPACITY"]
    np.testing.assert_array_equal(values[which][:, 0], np.float32([0, 0.5, 1]))
