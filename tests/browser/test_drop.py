"""Bundles and sets for the public renderer that are dropped onto the page; files nobody should trust."""

import json
import struct
import zipfile
from base64 import b64encode

import numpy as np
import pytest
from fixtures import bundles
from fixtures.browser import served
from fixtures.bundles import Ground
from fixtures.dropped_files import drop, files_of, with_values, zipped
from fixtures.land_covers import write_cover_bundle

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.export import gswt

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
OTHER = Ground(discs=8, salt=99, speckle=20)
READ = """async text => {
  // what the page says against a zip: null if all of it is read
  const { openSource, readParts } = await import("./data/bundle.js");
  const { PageError } = await import("./data/checks.js");
  const { createComposer } = await import("./data/compose.js"), { run } = await import("./terrain/draw_order.js");
  const { readTerrain } = await import("./scene/open_terrain.js");
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  try {
    const { source, manifest } = await readTerrain(await openSource(new Blob([bytes])));
    const composer = createComposer(manifest);
    await readParts(manifest, source, { take: (index, buffer) => run(composer.add(index, buffer)) });
    return null;
  } catch (error) {
    if (error instanceof PageError) return error.message;
    throw error;
  }
}"""


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """The folder of another bundle than the page's own."""
    folder = tmp_path_factory.mktemp("other") / "bundle"
    bundles.write_bundle(folder, OTHER)
    return folder


@pytest.fixture(scope="module")
def grown(tmp_path_factory):
    """The folder of a bundle of two materials with an object."""
    folder = tmp_path_factory.mktemp("grown") / "bundle"
    write_cover_bundle(folder)
    return folder


def told(modules, data: bytes) -> str | None:
    return modules.evaluate(READ, b64encode(data).decode())


def changed(folder, where: str, value) -> bytes:
    """The bundle as a zip, with the value at a path of its manifest replaced: "tiles 3 z"."""
    return with_values(*(int(key) if key.isdigit() else key for key in where.split()), value=value)(folder)


HILLS = dict(kind="hills", height=1.0, wavelength=9.0, octaves=3, salt=5)
RELIEF = dict(kind="image", file="heights.bin", rows=4, columns=4, width=8.0, bytes=64)
SUN = dict(elevation=3.0, azimuth=0.0, source="exif")
FIRST = "tiles 0 chunks 0"


def planet(radius: float, cells: float) -> dict:
    return {"kind": "sphere", "radius": radius, "cells": cells}


@pytest.mark.parametrize(
    "where, value, words",
    [
        ("provenance", {"anything": [1]}, None),
        ("format", "ply", "this is not a terrain"),
        ("version", 3, "version 3, this page reads version 4. Make it again"),
        ("unit", {}, "“unit” is missing or makes no sense"),
        ("tile_side", 1e300, "“tile_side”"),
        ("eye_floor", -1, "“eye_floor”"),
        ("salt", 2**32, "“salt”"),
        ("ground_colour", [1e30] * 3, "“ground_colour”"),
        ("sky zenith", None, "“sky”"),
        ("sky sun", {"direction": [0, 0, 0]}, "“sky”"),
        ("encoding log_scale", [0, 9], "“encoding”"),
        ("encoding origin", [0, 0, 1e308], "“encoding”"),
        ("encoding step", [-1, 1, 1], "“encoding”"),
        ("directions 2", [0, 0, 0], "“directions”"),
        ("directions", [[0, 0, -1]] * 256, "“directions”"),
        ("levels", [None], "“levels”"),
        ("levels 0 band", "1e999", "“levels”"),
        ("levels 0 distance", None, "“levels”"),
        ("levels 1 distance", 9.0, "“levels”"),
        ("tiles", [{}] * 4096, "“tiles”"),
        ("tiles", [{}] * 15, "“tiles”"),
        ("tiles 3 tile", 4, "tile 3 is missing or makes no sense"),
        ("tiles 3 z", [2, 1], "tile 3 is missing"),
        ("tiles 3 uncertainty", 2, "tile 3 is missing"),
        ("tiles 3 chunks", [None], "tile 3 does not have one chunk for each of 2 levels"),
        ("materials", [], "“materials”"),
        ("objects", [{}], "“objects”"),
        ("heights", HILLS, None),
        ("heights", HILLS | {"octaves": 0}, "“heights”"),
        ("heights", RELIEF | {"bytes": 63}, "“heights”"),
        ("heights", RELIEF | {"rows": 4097, "bytes": 4 * 4 * 4097}, "“heights”"),
        ("heights", planet(24.0, 9), None),
        ("heights", planet(24.0, 11), "“heights”"),
        ("heights", planet(24.0, 9.5), "“heights”"),
        ("heights", planet(4e-9, 1), "“heights”"),
        ("light", SUN | {"elevation": 90}, None),
        ("light", SUN | {"elevation": 2.9}, "“light”"),
        ("light", SUN | {"azimuth": 360}, "“light”"),
        ("light", SUN | {"azimuth": "1e999"}, "“light”"),
        ("light", SUN | {"source": "__proto__"}, "“light”"),
        ("light", None, "“light”"),
        ("wind", 4, None),
        ("wind", -1, "“wind”"),
        ("wind", [1], "“wind”"),
        (f"{FIRST} count", -64, "contradicts itself"),
        (f"{FIRST} part", 9, "contradicts itself"),
        (f"{FIRST} first", -1, "contradicts itself"),
        (f"{FIRST} first", 2**40, "contradicts itself"),
        ("tiles 0 orders", [0] * 9, "the orders of tile 0 make no sense"),
        ("tiles 0 orders", [*range(8), 9], "the orders of tile 0 make no sense"),
        ("parts", [], "“parts” is missing or makes no sense"),
        ("parts 0 kind", 7, "“parts”"),
        ("parts 0 kind", "later", "contradicts itself"),
        ("parts 0 bytes", 0, "“parts”"),
        ("parts 0 size", 2**31, "“parts”"),
        ("parts 0 sha256", "none", "“parts”"),
        ("parts 0 sha256", "0" * 64, "is damaged (its SHA-256"),
        ("parts 0 file", "https://example.org/x.bin", "“parts”"),
        ("parts 0 file", "parts/x.bin", "x.bin is not among the dropped files"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_manifest_is_read_or_what_contradicts_itself_is_named(modules, other, where, value, words):
    message = told(modules, changed(other, where, value))
    assert message is None if words is None else words in message


RANGE = dict(kind="slope", weight=1.0, material=1, low=None, high=0.3, soft=0.1)


@pytest.mark.parametrize(
    "where, value, words",
    [
        ("materials 0 share", 2, "“materials” is missing or makes no sense"),
        ("materials 1 first_tile", 17, "“materials”"),
        ("materials 1 name", "", "“materials”"),
        ("classes", None, "“classes”"),
        ("classes salt", -1, "“classes”"),
        ("classes rule", [], "“classes”"),
        ("classes rule", [RANGE], None),
        ("classes rule", [RANGE] * 65, "“classes”"),
        ("classes rule 0 kind", "magic", "“classes”"),
        ("classes rule 0 weight", "1e999", "“classes”"),
        ("classes rule 0 gains", [[1.0], [1.0] * 9], "“classes”"),
        ("classes rule 0 wavelengths", [3], "“classes”"),
        ("classes rule 0 wavelengths", [0, 1], "“classes”"),
        ("classes rule", [RANGE | {"material": 2}], "“classes”"),
        ("classes rule", [RANGE | {"soft": 0}], "“classes”"),
        ("classes rule", [RANGE | {"low": "x"}], "“classes”"),
        ("classes painted", [[0, 0, 2**60, 0]], "“classes”"),
        ("classes jitter cells", 2**31, "“classes”"),
        ("classes jitter gains", [0.0], "“classes”"),
        ("classes jitter amplitude", "1e999", "“classes”"),
        ("classes rise ground", [0.0], "“classes”"),
        ("classes rise most", -1, "“classes”"),
        ("heights", planet(24.0, 9), "“heights”"),
        ("objects", [], "“objects”"),
        ("objects", [{}] * 257, "“objects”"),
        ("objects 0 radius", 1e6, "“objects”"),
        ("objects 0 material", 2, "“objects”"),
        ("objects 0 probability", 1.5, "“objects”"),
        ("objects 0 z", [1, 0], "“objects”"),
        ("objects 0 chunks 1 count", 31, "contradicts itself"),
        ("objects 0 chunks", [], "object 0 does not have one chunk for each"),
        ("scatter", None, "“scatter”"),
        ("scatter cells", 1e6, "“scatter”"),
        ("scatter cells", 64, "820 objects stand on a tile"),
        ("scatter size", 1, "“scatter”"),
        ("scatter turn", "1e999", "“scatter”"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_what_contradicts_itself_in_materials_and_objects_is_named(modules, grown, where, value, words):
    message = told(modules, changed(grown, where, value))
    assert message is None if words is None else words in message


def with_hole(folder) -> bytes:
    """A height map with a height that is no number."""
    pixels = np.full((4, 4), 0.5, "<f4")
    pixels[2, 1] = np.nan
    files = files_of(folder)
    manifest = json.loads(files["davgswt.json"]) | {"heights": RELIEF}
    return zipped(files | {"heights.bin": pixels.tobytes(), "davgswt.json": json.dumps(manifest).encode()})


def with_file(folder, change) -> bytes:
    """The bundle as a zip, with other bytes in a part; None: without it."""
    files = files_of(folder)
    name = min(name for name in files if name.startswith("parts/"))
    data = change(files.pop(name))
    return zipped(files if data is None else files | {name: data})


def patched(at: int, form: str, value: int, content: bytes = b" " * 9000, record: bytes = b"PK\x01\x02") -> bytes:
    """A zip of one file with another number in its entry in the table, or in the record of its end."""
    data = bytearray(zipped({"davgswt.json": content}))
    struct.pack_into(form, data, data.rindex(record) + at, value)
    return bytes(data)


def with_end(at: int, form: str, value: int) -> bytes:
    return patched(at, form, value, record=b"PK\x05\x06")


def flip(data: bytes) -> bytes:
    found = bytearray(data)
    found[found.index(b'"format"') + 30] ^= 1
    return bytes(found)


def ply_header(count: int, *properties: str) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    return "\n".join([*lines, *(f"property float {name}" for name in properties), "end_header\n"]).encode()


def tiles_of(content: bytes, many: int = 16, first: bytes | None = None) -> bytes:
    return zipped({f"lod0_tile_{t:02d}.ply": content if t or first is None else first for t in range(many)})


PLY_NAMES = ["x", "y", "z", "opacity", *(f"f_dc_{k}" for k in range(3)), *(f"scale_{k}" for k in range(3))]
PLY_NAMES += [f"rot_{k}" for k in range(4)]


def splat(**values) -> bytes:
    return ply_header(1, *PLY_NAMES) + struct.pack("<14f", *(values.get(name, 0.5) for name in PLY_NAMES))


@pytest.mark.parametrize(
    "spoil, words",
    [
        pytest.param(lambda f: zipped(files_of(f, "folder/"), zipfile.ZIP_STORED), None, id="sound"),
        pytest.param(with_hole, "heights.bin: a height is not finite", id="NaN in the relief"),
        pytest.param(lambda f: with_file(f, lambda data: data[:-9]), ".bin is cut short: ", id="cut"),
        pytest.param(lambda f: with_file(f, lambda data: data + b"x"), ".bin is too long", id="long"),
        pytest.param(lambda f: with_file(f, lambda data: None), "is not among the dropped files", id="no part"),
        pytest.param(lambda f: zipped({"davgswt.json": b"{"}), "davgswt.json is not readable as JSON", id="no JSON"),
        pytest.param(lambda f: zipped({"davgswt.json": b" " * (2**26 + 1)}), "is too large for what it is", id="bomb"),
        pytest.param(lambda f: zipped({"readme.txt": b"hello"}), "There is no terrain in what was dropped", id="other"),
        pytest.param(lambda f: zipped(files_of(f))[:-400], "its end is missing", id="truncated"),
        pytest.param(lambda f: b"no zip at all", "its end is missing", id="no zip"),
        pytest.param(lambda f: with_end(10, "<H", 0xFFFF), "of the large kind", id="zip64"),
        pytest.param(lambda f: with_end(10, "<H", 5000), "5000 entries, at most 4096", id="too many entries"),
        pytest.param(lambda f: with_end(10, "<H", 4000), "its table is damaged", id="more entries than there are"),
        pytest.param(lambda f: with_end(12, "<I", 2**31), "its table lies outside of it", id="table beyond the file"),
        pytest.param(lambda f: with_end(16, "<I", 7), "its table is damaged", id="table elsewhere"),
        pytest.param(lambda f: patched(8, "<H", 1), "is locked with a password", id="password"),
        pytest.param(lambda f: patched(10, "<H", 12), "is packed in a way (12)", id="method"),
        pytest.param(lambda f: patched(16, "<I", 7), "its checksum is another", id="checksum"),
        pytest.param(lambda f: patched(24, "<I", 10), "is larger than was promised", id="more than promised"),
        pytest.param(lambda f: patched(24, "<I", 9001), "is cut short", id="less than promised"),
        pytest.param(lambda f: patched(24, "<I", 2_000_000_000), "contradicts its own size", id="declared size"),
        pytest.param(lambda f: patched(42, "<I", 1), "is not where the table says", id="elsewhere"),
        pytest.param(lambda f: flip(zipped(files_of(f), zipfile.ZIP_STORED)), "is damaged", id="flipped"),
        *(
            pytest.param(lambda f, name=name: zipped({name: b"{}"}), "leads out of it", id=name)
            for name in ("a\\..\\davgswt.json", "c:davgswt.json", "../davgswt.json", "/etc/davgswt.json")
        ),
        pytest.param(lambda f: tiles_of(splat()), None, id="set"),
        pytest.param(lambda f: tiles_of(splat(), 272), "272 tiles, this page shows 256", id="tiles of a set"),
        pytest.param(lambda f: tiles_of(splat(), 1), "1 tiles, a multiple of 16 is needed", id="one tile"),
        pytest.param(lambda f: zipped({"lod0_tile_15.ply": splat()}), "Tile 0 of level 0 is missing", id="no tile"),
        pytest.param(lambda f: zipped({"lod9_tile_15.ply": splat()}), "10 levels, this page shows 8", id="levels"),
        pytest.param(lambda f: tiles_of(b"ply\n"), "it has no PLY header", id="no header"),
        pytest.param(lambda f: tiles_of(splat().replace(b"little", b"big")), "not in binary_little_endian", id="order"),
        pytest.param(lambda f: tiles_of(splat().replace(b"float x", b"uchar x")), "a property is no float", id="uchar"),
        pytest.param(lambda f: tiles_of(splat().replace(b"rot_3", b"rot_4")), "property rot_3 is missing", id="rot_3"),
        pytest.param(lambda f: tiles_of(ply_header(10**12, *PLY_NAMES)), "cut short or too long", id="PLY count"),
        pytest.param(lambda f: tiles_of(ply_header(-1, *PLY_NAMES)), "it has no splats", id="PLY without splats"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(x=1e30)), "too far away or too large", id="PLY afar"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(x=1e5)), "dozens of tile sides from the", id="PLY apart"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(scale_1=700)), "too far away or too la", id="PLY haze"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(x=np.nan)), "a value that is not finite", id="PLY NaN"),
    ],
)
def test_a_zip_is_read_or_refused_with_what_is_wrong(modules, other, spoil, words):
    message = told(modules, spoil(other))
    assert message is None if words is None else words in message


@pytest.mark.parametrize(
    "answer, size, found",
    [
        ("new Response(new Uint8Array(5))", 5, 5),
        ("new Response(new Uint8Array(5))", None, 5),
        ("new Response(new Uint8Array(4))", 5, "a.bin is cut short: 4 bytes came, 5 were promised"),
        ("new Response(new Uint8Array(6))", 5, "a.bin is too long: 6 bytes came"),
        ("new Response('', { status: 404 })", 5, "a.bin is not there (the server answered 404)"),
        ("Promise.reject(new TypeError())", 5, "a.bin cannot be reached. Is “make view” still running?"),
        ("new Response(new ReadableStream({ start: c => c.error(new Error()) }))", 5, "a.bin is cut short: 0 bytes"),
        ("new Response(new Uint8Array(2 ** 26 + 1))", None, "a.bin is too large for what it is"),
    ],
)
def test_a_file_of_the_web_has_the_size_that_was_promised(modules, answer, size, found):
    told = modules.evaluate(
        f"""async size => {{
          const {{ webSource }} = await import("./data/source.js"), usual = globalThis.fetch;
          globalThis.fetch = async () => {answer};
          const read = webSource(new URL("https://a.test/")).read("a.bin", size);
          return read.then(b => b.byteLength, e => e.message).finally(() => {{ globalThis.fetch = usual; }});
        }}""",
        size,
    )
    assert told == found if isinstance(found, int) else found in told


def open_dropped(target, data: bytes) -> None:
    """Drop a zip that the page opens."""
    opened = target.page.evaluate("davgswt.state.opened")
    drop(target, "bundle.zip", data)
    target.until(f"davgswt.state.opened === {opened + 1}")
    assert not target.page.get_by_role("alert").is_visible()


def test_a_broken_zip_is_told_and_a_sound_bundle_takes_the_place_of_the_pages_own(target, still, page_of, other):
    """What the manifest says besides is left aside, however deep it is."""
    before = target.at(**OBLIQUE)
    drop(target, "bundle.zip", b"no zip at all")
    alert = target.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert "its end is missing" in alert.inner_text()
    alert.click()
    assert not alert.is_visible(), "a click takes the message away"
    files, deep = files_of(other, "folder/"), "[" * 100_000 + "]" * 100_000
    name = "folder/davgswt.json"
    for old, new in ('"provenance": {}', f'"provenance": {deep}'), ('"sky": {', f'"sky": {{"kind": {deep}, '):
        assert old in files[name].decode()
        files[name] = files[name].replace(old.encode(), new.encode())
    open_dropped(target, zipped(files))
    after = target.at(**OBLIQUE)
    assert (after != before).any()
    with served(page_of(OTHER)) as address:
        assert (still(address).at(**OBLIQUE) == after).all()


def test_a_gswt_zip_of_the_public_renderer_is_shown(target, other, tmp_path):
    manifest = json.loads((other / "davgswt.json").read_text())
    gswt.write_gswt(Bundle(other, Manifest.from_dict(manifest)).fields(), OTHER.side, tmp_path / "gswt.zip")
    open_dropped(target, (tmp_path / "gswt.zip").read_bytes())
    picture = target.at(x=2.0, y=2.0, eye=1.5, yaw=90, pitch=-90)
    # the set's own eye floor keeps the eye so high that hundreds of tiles are in the picture: it has their mean colour
    assert np.abs(picture.mean((0, 1)) - np.mean([bundles.colour_of(t) for t in range(16)], 0)).max() < 4
    assert picture.std() > 5
