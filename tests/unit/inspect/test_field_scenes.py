"""Gaussians as solids: their place, size, direction and colour; colours that stand for numbers."""

import numpy as np
import pytest
from matplotlib import colormaps
from scipy.spatial.transform import Rotation

from dav_gswt import field as fields
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.inspect import field_scenes as seen
from dav_gswt.inspect import scene
from dav_gswt.inspect.options import ViewOptions

LEVEL = Rotation.identity()


def one(sigma=(0.1, 0.1, 0.1), ground=False, turn=LEVEL, opacity=4.0, uncertainty=0.0):
    return GaussianField(
        np.float32([[1.0, 2.0, 3.0]]),
        np.log(np.float32([sigma])),
        np.roll(turn.as_quat(), 1)[None].astype(np.float32),
        np.float32([opacity]),
        rgb_to_sh(np.array([[0.2, 0.4, 0.6]])),
        np.float32([uncertainty]),
        np.array([ground]),
    )


def volume(layer):
    a, b, c = (layer.points[layer.cells[:, k]].astype(float) - layer.points.mean(0) for k in range(3))
    return np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6


def test_a_round_gaussian_is_a_solid_of_its_ellipsoids_volume_with_its_sides_outwards():
    turn = Rotation.from_euler("xyz", [20, 50, 80], degrees=True)
    (layer,) = seen.make_solids(one([0.3, 0.1, 0.2], turn=turn), np.uint8([[9, 8, 7]]))
    assert abs(volume(layer)) == pytest.approx(4 / 3 * np.pi * 0.3 * 0.1 * 0.2, rel=1e-5)
    long = layer.points - layer.points.mean(0)
    along = long[np.linalg.norm(long, axis=1).argmax()]
    assert abs(along @ turn.as_matrix()[:, 0]) == pytest.approx(np.linalg.norm(along), rel=1e-5)
    np.testing.assert_allclose(layer.points.mean(0), [1, 2, 3], atol=1e-6)


def test_a_disc_is_a_hexagon_of_its_ellipses_area_across_its_least_axis():
    turn = Rotation.from_euler("y", 30, degrees=True)
    (layer,) = seen.make_solids(one([0.2, 0.001, 0.1], ground=True, turn=turn), np.uint8([[9, 8, 7]]))
    ring = layer.points.astype(float) - [1, 2, 3]
    np.testing.assert_allclose(ring @ turn.as_matrix()[:, 1], 0, atol=1e-6)
    area = np.linalg.norm(np.cross(ring, np.roll(ring, -1, 0)).sum(0)) / 2
    assert area == pytest.approx(np.pi * 0.2 * 0.1, rel=1e-5)
    np.testing.assert_array_equal(layer.cells, [[0, 1, 2, 3, 4, 5]])


def test_faint_gaussians_are_left_out_and_large_fields_are_thinned_evenly():
    many = fields.concatenate_fields([one(opacity=-9.0)] + [one(uncertainty=i / 100) for i in range(100)])
    assert len(seen.thin_field(many, 1000)) == 100
    np.testing.assert_allclose(seen.thin_field(many, 4).uncertainty, [0, 0.33, 0.66, 0.99], atol=1e-6)


def test_a_field_is_coloured_by_what_is_asked_or_says_why_it_cannot_be(tmp_path):
    path = tmp_path / "level2_of.ply"
    fields.write_field(one(uncertainty=1.0), path)
    shown = {by: seen.build_field(path, ViewOptions(colour=by)).layers[0].colours[0] for by in seen.COLOUR_NAMES}
    np.testing.assert_array_equal(shown["colour"], [51, 102, 153])
    np.testing.assert_array_equal(shown["uncertainty"], scene.map_colours(np.ones(1), scene.ColourBar("", 0.0, 1.0))[0])
    np.testing.assert_array_equal(shown["level"], seen.level_colour(2))
    for colour, opacity, said in (
        ("hue", 4.0, "--colour hue: .* has colour, uncertainty, level"),
        ("level", 4.0, "no level by its name"),
        (None, -9.0, "there is nothing to draw"),
    ):
        fields.write_field(one(opacity=opacity), tmp_path / "field.ply")
        with pytest.raises(InputError, match=said):
            seen.build_field(tmp_path / "field.ply", ViewOptions(colour=colour))


def test_colours_run_from_one_end_of_a_bar_to_the_other_and_what_is_no_number_is_grey():
    found = scene.map_colours(np.array([2.0, -9.0, 4.0, 99.0, 3.0, np.nan, np.inf]), scene.ColourBar("", 2.0, 4.0))
    cool, warm = (scene.to_bytes(np.array(colormaps["coolwarm"](x)[:3])) for x in (0, 255))
    np.testing.assert_array_equal(found[:4], [cool, cool, warm, warm])
    assert np.ptp(found[4].astype(int)) < 10  # grey in the middle
    np.testing.assert_array_equal(found[5:], [scene.UNKNOWN] * 2)
    assert scene.make_bar("a", np.full(3, 7.0)) == scene.ColourBar("a", 7.0, 8.0)
    assert scene.make_bar("a", np.array([np.nan])) == scene.ColourBar("a", 0.0, 1.0)
