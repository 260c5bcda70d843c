"""Files of painted materials from the page, and the rule that reads them."""

import json
from dataclasses import replace

import pytest
from fixtures.land_covers import SIDE, two_classes

from dav_gswt.bundle.land_cover import ObjectOrders, ScatterEntry
from dav_gswt.bundle.manifest import MaterialEntry, TileSetInfo
from dav_gswt.errors import InputError
from dav_gswt.terrain.class_rules import apply_rule
from dav_gswt.terrain.paint_file import read_paint

NAMES = ["sand", "grass"]
FILE = {"format": "davgswt-paint", "version": 1, "materials": ["grass", "sand"], "runs": [[0, 0, 3, 0], [1, 1, 1, 1]]}


@pytest.fixture
def write(tmp_path):
    def write(**changes) -> dict:
        (tmp_path / "painted.json").write_text(json.dumps(FILE | changes))
        return {"kind": "painted", "file": str(tmp_path / "painted.json")}

    return write


@pytest.fixture
def manifest():
    materials = [MaterialEntry("sand", 0.6, 0, [0.5] * 3), MaterialEntry("grass", 0.4, 16, [0.5] * 3)]
    shrub = ObjectOrders("shrub", 0.4, [0.0, 1.0], 0.0, 1, 0.1, 0.3, [])
    objects = [shrub, replace(shrub, name="stone", material=0), replace(shrub, name="tuft")]
    scatter = ScatterEntry(4, 15.0, 0.15, 7)
    return TileSetInfo(
        SIDE, 7, 1.0, [0.5] * 3, [], [], [], materials, classes=two_classes(), objects=objects, scatter=scatter
    )


def test_materials_are_found_by_their_names(manifest, write):
    made, _ = apply_rule(manifest, [{"kind": "noise"}, write()])
    assert made.classes.painted == [[0, 0, 3, 1], [1, 1, 1, 0]]
    assert made.classes.rule == manifest.classes.rule and made.objects == manifest.objects


def test_offsets_are_added_to_the_noise_and_densities_to_probabilities(manifest, write):
    entry = write(densities={"shrub": 0.5, "stone": 2}, offsets={"grass": 0.25})
    made, _ = apply_rule(manifest, [{"kind": "noise"}, entry])
    assert made.classes.rule[0].biases == [0.05, 0.25]
    assert [each.probability for each in made.objects] == pytest.approx([0.15, 0.6, 0.3])


def test_probabilities_of_one_material_sum_to_one_at_most(manifest, write):
    made, _ = apply_rule(manifest, [{"kind": "noise"}, write(densities={"shrub": 3, "tuft": 3})])
    assert [each.probability for each in made.objects] == pytest.approx([0.5, 0.3, 0.5])


def test_densities_of_other_objects_are_told(manifest, write, caplog):
    apply_rule(manifest, [{"kind": "noise"}, write(densities={"tower": 2})])
    assert "not there: tower" in caplog.text


def test_with_one_material_densities_count_alone(manifest, write):
    objects = [replace(each, material=0) for each in manifest.objects]
    alone = replace(manifest, materials=manifest.materials[:1], classes=None, objects=objects)
    entry = write(materials=["sand"], runs=[], densities={"stone": 0})
    made, _ = apply_rule(alone, [{"kind": "noise"}, entry])
    assert made.classes is None and made.objects[1].probability == 0


@pytest.mark.parametrize("rule", [[], [{"kind": "noise"}, None]])
def test_one_file_is_taken_beside_other_terms(manifest, write, rule):
    with pytest.raises(InputError, match="one file, beside other terms"):
        apply_rule(manifest, [entry or write() for entry in rule] + [write()])


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"version": 2}, "version"),
        ({"format": "x"}, "format"),
        ({"runs": [[0, 0, 1.5, 0]]}, "runs"),
        ({"runs": [[0, 0, 1, 5]]}, "a material that is not there"),
        ({"materials": ["mud", "sand"]}, "no material 'mud'; the terrain has sand, grass"),
        ({"densities": {"shrub": 4}}, "densities: beyond 0 to 3"),
        ({"offsets": {"sand": -9}}, "offsets: beyond 8"),
        ({"densities": [1]}, "densities"),
    ],
)
def test_bad_files_are_refused_by_name(write, changes, message):
    path = write(**changes)["file"]
    with pytest.raises(InputError, match="painted.json.*" + message):
        read_paint(path, NAMES)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    with (tmp_path / "painted.json").open("wb") as file:
        file.truncate(2**24 + 1)
    with pytest.raises(InputError, match="more than 16777216 bytes"):
        read_paint(tmp_path / "painted.json", NAMES)
