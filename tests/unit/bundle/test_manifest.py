"""The manifest's classes and the JSON schema of davgswt.json describe the same objects."""

import json
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from dav_gswt.bundle.chunks import ChunkEntry
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.manifest import LevelEntry, Manifest, OrdersReport, RoundingErrors, Sky, TileEntry

SCHEMA = Path(__file__).parents[3] / "workflow/schemas/davgswt.schema.json"
MANIFEST = json.loads(SCHEMA.read_text(encoding="utf-8"))
PARTS = MANIFEST["properties"]
TILE = PARTS["tiles"]["items"]


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
        pytest.param(ChunkEntry, TILE["properties"]["chunks"]["items"], id="chunk"),
    ],
)
def test_a_class_has_the_keys_of_its_schema(model, rules):
    assert {field.name for field in fields(model)} == set(rules["properties"])
    assert set(rules["required"]) == set(rules["properties"]) - ({"heights"} if model is Manifest else set())


def test_only_a_page_says_what_surface_lies_under_its_tiles():
    optional = [field.name for field in fields(Manifest) if field.default is not MISSING]
    assert optional == ["heights"]
