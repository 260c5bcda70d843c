"""Bundles of several materials with objects, and their light."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made
from fixtures.frames import scene_frame
from fixtures.land_covers import TILES, cover_content

from dav_gswt.bundle import build, manifest, store
from dav_gswt.bundle.content import find_light
from dav_gswt.bundle.land_cover import LightEntry
from dav_gswt.bundle.manifest import Manifest, read_manifest
from dav_gswt.bundle.parts import read_part, unpack_block
from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.sun import CapturedSun
from dav_gswt.materials.build import find_materials
from dav_gswt.materials.shading import Sun
from dav_gswt.materials.store import write_materials


@pytest.fixture(scope="module")
def content():
    return cover_content()


@pytest.fixture(scope="module")
def bundle(content, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle") / "b"
    build.write_bundle(content, folder, build.BundleOptions(tau=0.5, salt=7), {})
    return store.read_bundle(folder)


def test_tiles_of_a_material_follow_those_of_the_one_before(bundle, content):
    assert [entry.first_tile for entry in bundle.manifest.materials] == [0, TILES]
    assert len(bundle.manifest.tiles) == 2 * TILES
    for number in (3, TILES + 3):
        source = content.tiles[number // TILES].fields[1][3]
        assert bundle.chunk(number, 1).means == pytest.approx(source.means, abs=1e-3)
    assert [(each.name, each.share) for each in bundle.manifest.materials] == [("sand", 0.6), ("grass", 0.4)]
    green = bundle.manifest.materials[1].ground_colour
    assert green == pytest.approx(content.materials[1].colour, abs=0.02)
    mixed = 0.6 * np.array(bundle.manifest.materials[0].ground_colour) + 0.4 * np.array(green)
    assert bundle.manifest.ground_colour == pytest.approx(mixed)


def test_an_object_is_stored_in_the_middle_of_a_tile_and_read_back_about_its_foot(bundle, content):
    entry = bundle.manifest.objects[0]
    assert (entry.name, entry.radius, entry.material) == ("shrub", content.objects[0].radius, 1)
    for level, source in enumerate(content.objects[0].fields):
        assert bundle.object_chunk(0, level).means == pytest.approx(source.means, abs=1e-3)
    chunk, code = entry.chunks[0], bundle.manifest.encoding
    rows = unpack_block(read_part(bundle.folder, bundle.manifest.parts[chunk.part])).to_records()
    stored = code.decode(rows[chunk.first : chunk.first + chunk.count]).means
    assert stored[:, :2].mean(0) == pytest.approx([0.5 * content.side] * 2, abs=0.05)


@pytest.mark.parametrize(
    "key, change",
    [
        ("first tiles", lambda m: m["materials"][1].update(first_tile=8)),
        ("16 C", lambda m: m["materials"].append(m["materials"][0])),
        ("classes", lambda m: m.pop("classes")),
        ("one value for each", lambda m: m["classes"]["rise"].update(ground=[0.0])),
        ("scatter", lambda m: m.pop("scatter")),
        ("objects", lambda m: m.update(objects=[])),
        ("material", lambda m: m["objects"][0].update(material=2)),
        ("object 0", lambda m: m["objects"][0]["chunks"].pop()),
    ],
)
def test_a_manifest_whose_cover_contradicts_itself_is_refused(bundle, key, change):
    value = bundle.manifest.to_dict()
    change(value)
    with pytest.raises(InputError, match=f"(?i){key}"):
        manifest.Manifest.from_dict(value)


FRAME = scene_frame()
LOCATED = replace(
    FRAME,
    georeference=Georeference(47.1, 8.0, 430.0, 300.0, metres_per_unit=1.0),
    sun=CapturedSun(34.5, 280.0, "2024-06-23T16:00:00Z", "gps", 0.0, 0.1),
)
ASSUMED = LightEntry(45.0, 225.0, "assumed")
C, S = np.cos(np.radians(8)), np.sin(np.radians(8))


@pytest.fixture(scope="module")
def materials(tmp_path_factory):
    """Folders of materials whose relief tells a sun 45 degrees high in the north-west, and none."""
    found = find_materials(made.field(mixed=False, shrubs=False), made.grid(), 0)
    sun = Sun(np.array([-0.5, 0.5, np.sqrt(0.5)]), np.array([0.3, 0.3, 0.3]), 0.5)
    folder = tmp_path_factory.mktemp("materials")
    for name, own in (("sun", sun), ("none", None)):
        write_materials(replace(found, classes=replace(found.classes, sun=own)), folder / name, {})
    return folder


def test_exif_counts_before_relief_and_is_turned_from_north_to_the_tiles(materials):
    assert find_light(LOCATED, materials / "sun", {}) == LightEntry(34.5, 340.0, "exif", 300.0)
    # a place of the tile lies in the exemplar turned by 8 degrees, counter-clockwise
    assert find_light(LOCATED, None, {"pattern": {"turn": [[C, -S], [S, C]]}}) == LightEntry(34.5, 348.0, "exif", 292.0)


def test_relief_reveals_the_sun_in_the_world_and_otherwise_it_is_assumed_in_the_south_west(materials):
    assert find_light(FRAME, materials / "sun", {}) == LightEntry(45.0, 315.0, "relief")
    assert find_light(FRAME, materials / "none", {}) == ASSUMED
    assert find_light(FRAME, None, {}) == ASSUMED
    assert find_light(replace(LOCATED, sun=None), None, {}) == LightEntry(45.0, 285.0, "assumed", 300.0)


def test_a_manifest_holds_the_light_where_it_is_known_and_refuses_what_cannot_be(tmp_path):
    light = LightEntry(34.5, 340.0, "exif", 300.0)
    for name, own in (("lit", light), ("unknown", None)):
        build.write_bundle(cover_content(), tmp_path / name, build.BundleOptions(tau=0.5, light=own), {})
        assert read_manifest(tmp_path / name).light == own
    values = [json.loads((tmp_path / name / "davgswt.json").read_text()) for name in ("lit", "unknown")]
    assert values[0].pop("light") == vars(light) and values[0] == values[1]
    for wrong in (
        {"elevation": 2.9},
        {"elevation": 91.0},
        {"azimuth": 360.0},
        {"azimuth": -1.0},
        {"source": "moon"},
        {"north": 360.0},
    ):
        with pytest.raises(InputError, match=f"light.{next(iter(wrong))}"):
            Manifest.from_dict(values[1] | {"light": vars(light) | wrong})
