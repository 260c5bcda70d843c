"""The manifest's classes and the JSON schema of davgswt.json describe the same objects."""

import json
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from dav_gswt.bundle.chunks import ChunkEntry
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.land_cover import (
    ClassesEntry,
    ImageTerm,
    JitterEntry,
    NoiseTerm,
    ObjectEntry,
    RangeTerm,
    RiseEntry,
    ScatterEntry,
)
from dav_gswt.bundle.manifest import (
    LevelEntry,
    Manifest,
    MaterialEntry,
    OrdersReport,
    RoundingErrors,
    Sky,
    TileEntry,
    upgrade_manifest,
)

SCHEMA = Path(__file__).parents[3] / "workflow/schemas/davgswt.schema.json"
MANIFEST = json.loads(SCHEMA.read_text(encoding="utf-8"))
PARTS = MANIFEST["properties"]
TILE = PARTS["tiles"]["items"]
OPTIONAL = {"classes", "objects", "scatter", "heights"}


@pytest.mark.parametrize(
    "model, rules",
    [
        pytest.param(Manifest, MANIFEST, id="manifest"),
        pytest.param(Sky, PARTS["sky"], id="sky"),
        pytest.param(Encoding, PARTS["encoding"], id="encoding"),
        pytest.param(RoundingErrors, PARTS["error"], id="error"),
        pytest.param(OrdersReport, PARTS["orders"], id="orders"),
        pytest.param(LevelEntry, PARTS["levels"]["items"], id="level"),
        pytest.param(TileEntry, TILE, id="tile"),
        pytest.param(ChunkEntry, MANIFEST["$defs"]["chunks"]["items"], id="chunk"),
        pytest.param(MaterialEntry, PARTS["materials"]["items"], id="material"),
        pytest.param(ClassesEntry, PARTS["classes"], id="classes"),
        pytest.param(JitterEntry, PARTS["classes"]["properties"]["jitter"], id="jitter"),
        pytest.param(RiseEntry, PARTS["classes"]["properties"]["rise"], id="rise"),
        pytest.param(ObjectEntry, PARTS["objects"]["items"], id="object"),
        pytest.param(ScatterEntry, PARTS["scatter"], id="scatter"),
    ],
)
def test_a_class_has_the_keys_of_its_schema(model, rules):
    assert {field.name for field in fields(model)} == set(rules["properties"])
    optional = {Manifest: OPTIONAL, ClassesEntry: {"painted"}}.get(model, set())
    assert set(rules["required"]) == set(rules["properties"]) - optional


def test_the_schema_knows_the_keys_of_all_terms():
    known = {field.name for term in (NoiseTerm, RangeTerm, ImageTerm) for field in fields(term)}
    assert set(PARTS["classes"]["properties"]["rule"]["items"]["properties"]) == known


def test_only_surface_classes_and_objects_may_be_left_out():
    assert {field.name for field in fields(Manifest) if field.default is not MISSING} == OPTIONAL


def test_a_manifest_of_version_2_gets_its_only_material():
    new = upgrade_manifest({"version": 2, "ground_colour": [0.1, 0.2, 0.3]})
    assert new["version"] == 3
    assert new["materials"] == [{"name": "ground", "share": 1, "first_tile": 0, "ground_colour": [0.1, 0.2, 0.3]}]
