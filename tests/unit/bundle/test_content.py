"""Bundles of several materials with objects: numbers of tiles, chunks of objects, and refusals."""

import numpy as np
import pytest
from fixtures.land_covers import TILES, cover_content

from dav_gswt.bundle import build, manifest, store
from dav_gswt.bundle.parts import read_part, unpack_block
from dav_gswt.errors import InputError


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
