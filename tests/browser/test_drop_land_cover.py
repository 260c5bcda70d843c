"""Bundles of several materials and objects that are dropped onto the page."""

import json
from pathlib import Path

import pytest
from fixtures.dropped_files import drop, files_of, said, with_values, zipped
from fixtures.land_covers import write_cover_bundle

SCHEMA = Path(__file__).parents[2] / "workflow/schemas/davgswt.schema.json"
PICTURE = dict(kind="image", weight=1.0, file="classes0.bin", rows=2, columns=3, width=9.0, beyond="clamp", bytes=6)
RANGE = dict(kind="slope", weight=1.0, material=1, low=None, high=0.3, soft=0.1)


@pytest.fixture(scope="module")
def cover(tmp_path_factory):
    """The folder of a bundle of two materials with an object."""
    folder = tmp_path_factory.mktemp("cover") / "bundle"
    write_cover_bundle(folder, SCHEMA)
    return folder


@pytest.mark.parametrize(
    "where, value, key",
    [
        pytest.param(["materials", 0, "share"], 2, "materials", id="share"),
        pytest.param(["materials", 1, "first_tile"], 17, "materials", id="first tile"),
        pytest.param(["materials", 1, "first_tile"], 1e300, "materials", id="first tile nowhere"),
        pytest.param(["materials", 1, "name"], "", "materials", id="no name"),
        pytest.param(["materials"], [None, None], "materials", id="no materials"),
        pytest.param(["materials"], {}, "materials", id="materials are no list"),
        pytest.param(["classes"], None, "classes", id="no classes"),
        pytest.param(["classes", "salt"], -1, "classes", id="salt of classes"),
        pytest.param(["classes", "rule"], [], "classes", id="no rule"),
        pytest.param(["classes", "rule"], [RANGE] * 65, "classes", id="too many terms"),
        pytest.param(["classes", "rule", 0, "kind"], "magic", "classes", id="kind of a term"),
        pytest.param(["classes", "rule", 0, "weight"], "1e999", "classes", id="infinite weight"),
        pytest.param(["classes", "rule", 0, "octaves"], [2, 1000], "classes", id="octaves"),
        pytest.param(["classes", "rule", 0, "wavelengths"], [3], "classes", id="one wavelength"),
        pytest.param(["classes", "rule", 0, "wavelengths"], [0, 1], "classes", id="no wavelength"),
        pytest.param(["classes", "rule"], [RANGE | {"material": 2}], "classes", id="material of a range"),
        pytest.param(["classes", "rule"], [RANGE | {"soft": 0}], "classes", id="hard range"),
        pytest.param(["classes", "rule"], [RANGE | {"low": "x"}], "classes", id="bound"),
        pytest.param(["classes", "rule"], [PICTURE | {"bytes": 7}], "classes", id="bytes of a picture"),
        pytest.param(["classes", "rule"], [PICTURE | {"file": "../x.bin"}], "classes", id="a picture above"),
        pytest.param(["classes", "rule"], [PICTURE | {"rows": 8192, "bytes": 24576}], "classes", id="large picture"),
        pytest.param(["classes", "rule"], [PICTURE, PICTURE], "classes", id="a picture twice"),
        pytest.param(["classes", "painted"], [[0, 0, 1]], "classes", id="painted"),
        pytest.param(["classes", "painted"], [[0, 0, 2**60, 0]], "classes", id="much painted"),
        pytest.param(["classes", "painted"], {}, "classes", id="painted is no list"),
        pytest.param(["classes", "jitter", "cells"], 2**31, "classes", id="fine jitter"),
        pytest.param(["classes", "jitter", "octaves"], 60, "classes", id="octaves of the jitter"),
        pytest.param(["classes", "jitter", "amplitude"], "1e999", "classes", id="endless jitter"),
        pytest.param(["classes", "rise", "ground"], [0.0], "classes", id="one ground"),
        pytest.param(["classes", "rise", "most"], -1, "classes", id="negative rise"),
        pytest.param(["objects"], [], "objects", id="objects without any"),
        pytest.param(["objects"], [{}] * 257, "objects", id="too many objects"),
        pytest.param(["objects", 0, "radius"], 1e6, "objects", id="wide object"),
        pytest.param(["objects", 0, "material"], 2, "objects", id="material of an object"),
        pytest.param(["objects", 0, "probability"], 1.5, "objects", id="probability"),
        pytest.param(["objects", 0, "z"], [1, 0], "objects", id="object upside down"),
        pytest.param(["scatter"], None, "scatter", id="no scatter"),
        pytest.param(["scatter", "cells"], 1e6, "scatter", id="fine scatter"),
        pytest.param(["scatter", "size"], 1, "scatter", id="size of nothing"),
        pytest.param(["scatter", "turn"], "1e999", "scatter", id="endless turn"),
    ],
)
def test_what_contradicts_itself_in_materials_and_objects_is_named(target, cover, where, value, key):
    assert f"“{key}” is missing or makes no" in said(target, with_values(*where, value=value)(cover))


@pytest.mark.parametrize(
    "where, value, message",
    [
        pytest.param(["scatter", "cells"], 64, "820 objects stand on a tile", id="crowd"),
        pytest.param(["objects", 0, "chunks", 1, "count"], 31, "contradicts itself", id="count"),
        pytest.param(["objects", 0, "chunks"], [], "object 0 does not have one chunk for each", id="no chunk"),
        pytest.param(["objects", 0, "chunks"], [None] * 2, "object 0 does not have one chunk", id="null"),
        pytest.param(["classes", "rule"], [PICTURE], "classes0.bin is not among the dropped files", id="no picture"),
    ],
)
def test_what_is_wrong_with_files_of_objects_and_classes_is_said(target, cover, where, value, message):
    assert message in said(target, with_values(*where, value=value)(cover))


def test_classes_by_a_picture_are_shown(visit, plain, cover):
    """West of the picture's middle lies the first material, east of it the second."""
    files = files_of(cover) | {PICTURE["file"]: bytes([0, 0, 1, 0, 0, 1])}
    manifest = json.loads(files["davgswt.json"])
    manifest["classes"]["rule"] = [PICTURE]
    files["davgswt.json"] = json.dumps(manifest).encode()
    seen = visit(160, 100).open(f"{plain}?still")
    drop(seen, "bundle.zip", zipped(files))
    seen.until("davgswt.state.opened === 2")
    west, east = (seen.at(x=x, y=2.0, eye=1.5, yaw=90, pitch=-90).mean((0, 1)) for x in (-20.0, 20.0))
    assert west[0] > west[1] + 10 and east[1] > east[0] + 10, "sand is reddish, grass green"
