"""Classes: the numbers shared with the page, painted places, rules from the config and painted files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.land_covers import SIDE, gaussians, two_classes
from fixtures.terrains import manifest_of

from dav_gswt.bundle.land_cover import ClassesEntry, ObjectEntry, RangeTerm, ScatterEntry, find_run_fault
from dav_gswt.bundle.manifest import MaterialEntry
from dav_gswt.errors import InputError
from dav_gswt.files import parse_record
from dav_gswt.terrain.class_rules import apply_rule, read_paint
from dav_gswt.terrain.classes import LATTICE, Classes
from dav_gswt.terrain.heights import FlatSurface, Hills

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "classes.json").read_text())["terrains"]


def classes_of(terrain) -> Classes:
    surface, entry = terrain["heights"], parse_record(terrain["classes"], ClassesEntry)
    heights = FlatSurface()
    if surface["kind"] == "hills":
        heights = Hills(*(surface[key] for key in ("height", "wavelength", "octaves", "salt")))
    return Classes(entry, terrain["materials"], terrain["side"], heights)


def discs_at(places, z=0.0):
    means = np.concatenate([places * SIDE, np.full((len(places), 1), z)], 1)
    return gaussians(means, [0.5] * 3, 0.1).means


@pytest.mark.parametrize("terrain", GOLDEN, ids=range(len(GOLDEN)))
def test_numbers_are_those_shared_with_the_page(terrain):
    classes = classes_of(terrain)
    for cell in terrain["cells"]:
        i, j, places = cell["i"], cell["j"], cell["places"]
        assert classes.materials_in(np.array([i]), np.array([j])).tolist() == [cell["materials"]]
        corner = classes.lattice_scores(np.array([LATTICE * i]), np.array([LATTICE * j]))[0]
        np.testing.assert_allclose(corner, cell["corner"], rtol=0, atol=1e-9)
        means = np.array([[place[axis] for axis in "xyz"] for place in places], np.float32)
        u, v = (means[:, axis].astype(float) / terrain["side"] for axis in (0, 1))
        scores = classes.scores_at(np.full(len(u), i), np.full(len(u), j), u, v)
        np.testing.assert_allclose(scores, [place["scores"] for place in places], rtol=0, atol=1e-9)
        jitter = classes.jitter_at(i, j, u, v)
        np.testing.assert_allclose(jitter, [place["jitter"] for place in places], rtol=0, atol=1e-9)
        kept = classes.keep(i, j, means, np.array([place["material"] for place in places]))
        assert kept.tolist() == [place["kept"] for place in places]


@pytest.mark.parametrize("amplitude", [0.0, 0.05])
def test_every_place_keeps_the_disc_of_a_material(amplitude):
    classes = Classes(two_classes(amplitude), 2, SIDE)
    rng = np.random.default_rng(1)
    for i, j in rng.integers(-1000, 1000, (8, 2)).tolist():
        discs = discs_at(rng.random((200, 2)))
        sand, grass = (classes.keep(i, j, discs, np.full(200, m)) for m in (0, 1))
        assert (sand | grass).all()
        assert not (sand & grass).any(), "flat discs of both at one place: a blend"


@pytest.mark.parametrize(
    "run, fault",
    [
        ([0, 0, 1], "not four numbers"),
        ([0, 0, 0, 0], "beyond the bounds"),
        ([2**23, 0, 1, 0], "beyond the bounds"),
        ([0, -(2**23), 1, 0], "beyond the bounds"),
        ([0, 1, 2**18, 0], "more than 262144 places"),
        ([0, 0, 1, 2], "not there"),
    ],
)
def test_runs_that_make_no_sense_are_named(run, fault):
    assert find_run_fault([[0, 0, 5, 1]], 2) is None and fault in find_run_fault([[0, 0, 5, 1], run], 2)


NAMES = ["sand", "grass"]
RANGE = {"material": "grass", "low": 1, "high": None, "soft": 0.5, "weight": 2}
FILE = {"format": "davgswt-paint", "version": 1, "materials": ["grass", "sand"], "runs": [[0, 0, 3, 0], [1, 1, 1, 1]]}


@pytest.fixture
def manifest():
    materials = [MaterialEntry("sand", 0.6, 0, [0.5] * 3), MaterialEntry("grass", 0.4, 16, [0.5] * 3)]
    shrub = ObjectEntry("shrub", 0.4, [0.0, 1.0], 0.0, 1, 0.1, 0.3, [], [])
    objects = [shrub, replace(shrub, name="stone", material=0), replace(shrub, name="tuft")]
    cover = {"classes": two_classes(), "objects": objects, "scatter": ScatterEntry(4, 15.0, 0.15, 7)}
    return replace(manifest_of(1.0, [0.5] * 3), materials=materials, **cover)


@pytest.fixture
def write(tmp_path):
    def write(**changes) -> dict:
        (tmp_path / "painted.json").write_text(json.dumps(FILE | changes))
        return {"kind": "painted", "file": str(tmp_path / "painted.json")}

    return write


def test_heights_are_given_in_tile_sides_and_slopes_as_they_are(manifest):
    changed = apply_rule(manifest, [{"kind": "height"} | RANGE, {"kind": "slope"} | RANGE])
    assert changed.classes.rule == [
        RangeTerm("height", 2.0, 1, SIDE, None, 0.5 * SIDE),
        RangeTerm("slope", 2.0, 1, 1.0, None, 0.5),
    ]


def test_a_bad_term_is_refused_by_name(manifest, write):
    noiseless = replace(manifest, classes=replace(manifest.classes, rule=[]))
    for given, rule, said in (
        (manifest, [{"kind": "slope"} | RANGE | {"material": "mud"}], "no material 'mud'; the terrain has sand, grass"),
        (noiseless, [{"kind": "noise"}], "no noise of its own"),
        (manifest, [write()], "one file, beside other terms"),
        (manifest, [{"kind": "noise"}, write(), write()], "one file, beside other terms"),
    ):
        with pytest.raises(InputError, match=said):
            apply_rule(given, rule)


def test_painted_materials_are_found_by_their_names(manifest, write):
    made = apply_rule(manifest, [{"kind": "noise"}, write()])
    assert made.classes.painted == [[0, 0, 3, 1], [1, 1, 1, 0]]
    assert made.classes.rule == manifest.classes.rule and made.objects == manifest.objects


def test_offsets_are_added_to_the_noise_and_densities_to_probabilities(manifest, write, caplog):
    entry = write(densities={"shrub": 0.5, "stone": 2, "tower": 2}, offsets={"grass": 0.25})
    made = apply_rule(manifest, [{"kind": "noise"}, entry])
    assert made.classes.rule[0].biases == [0.05, 0.25]
    assert [each.probability for each in made.objects] == pytest.approx([0.15, 0.6, 0.3])
    assert "not there: tower" in caplog.text


def test_no_more_objects_stand_than_there_is_room_for(manifest, write):
    entry = write(densities={"shrub": 3, "tuft": 3})
    made = apply_rule(manifest, [{"kind": "noise"}, entry])
    assert [each.probability for each in made.objects] == pytest.approx([0.5, 0.3, 0.5]), "1 for a material's objects"
    dense = replace(manifest, scatter=replace(manifest.scatter, cells=64))
    made = apply_rule(dense, [{"kind": "noise"}, entry])
    assert 64**2 * sum(each.probability for each in made.objects) == pytest.approx(512), "what the page draws on a tile"


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"version": 2}, "version"),
        ({"runs": [[0, 0, 1, 5]]}, "a material that is not there"),
        ({"materials": ["mud", "sand"]}, "no material 'mud'; the terrain has sand, grass"),
        ({"densities": {"shrub": 4}}, "densities: beyond 0 to 3"),
        ({"offsets": {"sand": -9}}, "offsets: beyond 8"),
        ({"format": "x" * 2**24}, "more than 16777216 bytes"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_bad_painted_file_is_refused_by_name(write, changes, message):
    path = write(**changes)["file"]
    with pytest.raises(InputError, match="painted.json.*" + message):
        read_paint(path, NAMES)
