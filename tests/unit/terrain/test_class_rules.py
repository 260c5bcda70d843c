"""Rules of classes from the config."""

import numpy as np
import pytest
from fixtures.land_covers import SIDE, two_classes

from dav_gswt.bundle.land_cover import ImageTerm, RangeTerm
from dav_gswt.bundle.manifest import MaterialEntry, TileSetInfo
from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.terrain import class_rules
from dav_gswt.terrain.classes import Classes


@pytest.fixture
def manifest():
    materials = [MaterialEntry("sand", 0.6, 0, [0.5] * 3), MaterialEntry("grass", 0.4, 16, [0.5] * 3)]
    return TileSetInfo(SIDE, 7, 1.0, [0.5] * 3, [], [], [], materials, classes=two_classes())


@pytest.fixture
def picture(tmp_path):
    image = np.zeros((2, 3, 3))
    image[:, 0] = [1, 1, 0]
    image[:, 1] = [0, 0.98, 0]
    image_files.write_png(tmp_path / "classes.png", image)
    entry = {"kind": "image", "file": str(tmp_path / "classes.png"), "width": 30, "colours": {"grass": "#00ff00"}}
    return entry | {"colours": {"grass": "#00ff00", "sand": "#ffff00"}}


def test_the_default_is_the_noise_of_the_bundle(manifest):
    changed, pictures = class_rules.apply_rule(manifest, class_rules.NOISE)
    assert changed == manifest and pictures == {}


def test_a_weight_of_the_noise_replaces_its_own(manifest):
    changed, _ = class_rules.apply_rule(manifest, [{"kind": "noise", "weight": 0.5}])
    assert changed.classes.rule[0].weight == 0.5


def test_heights_are_given_in_tile_sides_and_slopes_as_they_are(manifest):
    entry = {"material": "grass", "low": 1, "high": None, "soft": 0.5, "weight": 2}
    changed, _ = class_rules.apply_rule(manifest, [{"kind": "height"} | entry, {"kind": "slope"} | entry])
    high, steep = changed.classes.rule
    assert high == RangeTerm("height", 2.0, 1, SIDE, None, 0.5 * SIDE)
    assert steep == RangeTerm("slope", 2.0, 1, 1.0, None, 0.5)


def test_a_picture_becomes_numbers_of_materials(manifest, picture):
    changed, pictures = class_rules.apply_rule(manifest, [picture])
    (term,) = changed.classes.rule
    assert isinstance(term, ImageTerm) and (term.rows, term.columns, term.width) == (2, 3, 30.0)
    assert pictures[term.file].tolist() == [[0, 1, 255]] * 2


def test_pixels_of_no_material_are_counted_in_a_warning(manifest, picture, caplog):
    class_rules.apply_rule(manifest, [picture])
    assert "33.3 % of the pixels" in caplog.text


def test_a_picture_of_none_of_the_materials_is_refused(manifest, picture):
    with pytest.raises(InputError, match="no pixel has the colour"):
        class_rules.apply_rule(manifest, [picture | {"colours": {"sand": "#ff00ff"}}])


def test_a_material_that_is_not_there_is_named_with_those_that_are(manifest):
    with pytest.raises(InputError, match="no material 'mud'; the terrain has sand, grass"):
        class_rules.apply_rule(manifest, [{"kind": "slope", "material": "mud", "soft": 1}])


def test_a_material_without_any_place_is_named_in_a_warning(manifest, caplog):
    entry = {"kind": "slope", "material": "grass", "low": 1, "soft": 0.1, "weight": 9}
    changed, _ = class_rules.apply_rule(manifest, [entry])
    class_rules.warn_of_missing(Classes(changed.classes, 2, SIDE), ["sand", "grass"])
    assert "leaves grass without any place (the ground is sand 100%)" in caplog.text


def test_materials_with_places_are_not_warned_of(manifest, caplog):
    class_rules.warn_of_missing(Classes(manifest.classes, 2, SIDE), ["sand", "grass"])
    assert not caplog.records


def test_a_rule_for_a_terrain_of_one_material_is_ignored_with_a_warning(manifest, caplog):
    one = TileSetInfo(SIDE, 7, 1.0, [0.5] * 3, [], [], [], manifest.materials[:1])
    changed, _ = class_rules.apply_rule(one, [{"kind": "slope", "material": "sand", "soft": 1}])
    assert changed is one and "has one material" in caplog.text
