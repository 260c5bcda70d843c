"""Bundles, sets for the public renderer and fly paths that are dropped onto the page; zips that nobody should trust."""

import hashlib
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fixtures import bundles
from fixtures.bundles import Ground
from fixtures.dropped_files import drop, files_of, said, with_values, zipped

from dav_gswt.bundle import gswt
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.study.terrain.browser import served

SCHEMA = Path(__file__).parents[2] / "workflow/schemas/davgswt.schema.json"
OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
OTHER = Ground(discs=8, salt=99, speckle=20)


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """The folder of another bundle."""
    folder = tmp_path_factory.mktemp("other") / "bundle"
    bundles.write_bundle(folder, OTHER)
    return folder


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_a_dropped_bundle_takes_the_place_of_the_pages_own(visit, plain, page_of, other, method):
    seen = visit(160, 100).open(f"{plain}?still")
    before = seen.at(**OBLIQUE)
    drop(seen, "bundle.zip", zipped(files_of(other, "folder/"), method))
    seen.until("davgswt.state.opened === 2")
    after = seen.at(**OBLIQUE)
    assert (after != before).any()
    assert not seen.page.locator("#error").is_visible()
    with served(page_of(OTHER)) as address:
        assert (visit(160, 100).open(f"{address}?still").at(**OBLIQUE) == after).all()


def test_a_gswt_zip_of_the_public_renderer_is_shown(visit, plain, other, tmp_path):
    manifest = json.loads((other / "davgswt.json").read_text())
    gswt.write_gswt(Bundle(other, Manifest.from_dict(manifest)).fields(), OTHER.side, tmp_path / "gswt.zip")
    seen = visit(160, 100).open(f"{plain}?still")
    drop(seen, "gswt.zip", (tmp_path / "gswt.zip").read_bytes())
    seen.until("davgswt.state.opened === 2")
    picture = seen.at(x=2.0, y=2.0, eye=1.5, yaw=90, pitch=-90)
    # the set's own eye floor keeps the eye so high that hundreds of tiles are in the picture: it has their mean colour
    assert np.abs(picture.mean((0, 1)) - np.mean([bundles.colour_of(t) for t in range(16)], 0)).max() < 4
    assert picture.std() > 5


def test_the_page_rounds_a_set_as_the_library_does(modules):
    rng = np.random.default_rng(4)
    fields = [rounded_before(rng, n) for n in (40, 300)]
    encoding = Encoding.fit(fields, 4.0, 0.01)
    lists = [[bytes_of(f), *(v.ravel().tolist() for v in (f.means, f.log_scales, f.quats))] for f in fields]
    told, found = modules.evaluate(
        """async sets => {
          const { fitEncoding, writeRecords } = await import("./data/quantize.js");
          const made = sets.map(([paint, ...rest]) => {
            const [centres, logScales, turns] = rest.map(list => new Float32Array(list));
            return { count: paint.length / 4, paint: new Uint8Array(paint), centres, logScales, turns };
          });
          const encoding = fitEncoding(made, 4, 0.01);
          return [encoding, made.map(one => {
            const out = new ArrayBuffer(16 * one.count);
            writeRecords(out, one, encoding);
            return [...new Uint8Array(out)];
          })];
        }""",
        lists,
    )
    for key, values in vars(encoding).items():
        np.testing.assert_allclose(told[key], values, rtol=1e-12, err_msg=key)
    for field, own in zip(fields, found, strict=True):
        assert bytes(own) == encoding.encode(field).tobytes()


def rounded_before(rng, n: int) -> GaussianField:
    """Gaussians whose colours and opacities are bytes already."""
    opacity = np.clip(rng.integers(1, 255, n) / 255, 1e-6, 1)
    return GaussianField(
        rng.uniform(-0.2, 4.3, (n, 3)).astype(np.float32),
        rng.uniform(-12, 3, (n, 3)).astype(np.float32),  # some are cut, below and above
        rng.normal(size=(n, 4)).astype(np.float32),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        rgb_to_sh((rng.integers(0, 256, (n, 3)) / 255).astype(np.float32)),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def bytes_of(field: GaussianField) -> list[int]:
    opacity = 1 / (1 + np.exp(-field.opacity_logits.astype(float)))
    return np.rint(255 * np.concatenate([field.base_colours, opacity[:, None]], 1)).astype(int).ravel().tolist()


def test_a_folder_is_found_wherever_its_manifest_lies(modules):
    found = modules.evaluate(
        """async () => {
          const { sourceOf } = await import("./data/open.js");
          const bytes = (size) => ({ size, open: async () => new ArrayBuffer(size) });
          const files = new Map([["a/b/davgswt.json", bytes(1)], ["a/b/chunks/x.bin", bytes(5)], ["c.txt", bytes(9)]]);
          const source = await sourceOf(files);
          const size = (name) => source.read(name, null).then(b => b.byteLength, e => e.message);
          return [await size("davgswt.json"), await size("chunks/x.bin"), await size("c.txt")];
        }"""
    )
    assert found[:2] == [1, 5] and "c.txt is not among the dropped files" in found[2]


def with_manifest(folder, **changes) -> bytes:
    files = files_of(folder)
    files["davgswt.json"] = json.dumps(json.loads(files["davgswt.json"]) | changes).encode()
    return zipped(files)


def without(folder, name) -> bytes:
    return zipped({n: data for n, data in files_of(folder).items() if n != name})


def shrunk(folder) -> bytes:
    """A zip whose table promises fewer bytes than an entry unpacks to."""
    data = bytearray(zipped({"davgswt.json": b" " * 100_000}))
    at = data.rindex(b"PK\x01\x02")
    data[at + 24 : at + 28] = struct.pack("<I", 10)
    return bytes(data)


def flipped(folder) -> bytes:
    data = bytearray(zipped(files_of(folder), zipfile.ZIP_STORED))
    data[data.index(b'"format"') + 30] ^= 1
    return bytes(data)


def with_chunk(**changes):
    """The bundle as a zip, with other keys of its first chunk."""
    return lambda folder: with_values("tiles", 0, "chunks", 0, value=first_chunk(folder) | changes)(folder)


def first_chunk(folder) -> dict:
    return json.loads((folder / "davgswt.json").read_text())["tiles"][0]["chunks"][0]


def with_order(change):
    """The bundle as a zip, with changed orders of its first chunk and the digest of that."""

    def spoil(folder) -> bytes:
        files, entry = files_of(folder), first_chunk(folder)
        data = bytearray(files[entry["file"]])
        orders = np.frombuffer(data, "<u2", offset=16 * entry["count"]).reshape(-1, entry["count"])
        change(orders)
        files[entry["file"]] = bytes(data)
        manifest = json.loads(files["davgswt.json"])
        manifest["tiles"][0]["chunks"][0]["sha256"] = hashlib.sha256(data).hexdigest()
        files["davgswt.json"] = json.dumps(manifest).encode()
        return zipped(files)

    return spoil


def beyond(orders):
    orders[3, 5] = 65535


def in_a_loop(orders):
    orders[3, :] = np.roll(np.arange(orders.shape[1]) // 2 * 2, 1)


def with_relief(folder) -> bytes:
    """A height map with a height that is no number."""
    pixels = np.full((4, 4), 0.5, "<f4")
    pixels[2, 1] = np.nan
    entry = dict(kind="image", file="heights.bin", rows=4, columns=4, width=8.0, bytes=64)
    files = files_of(folder) | {"heights.bin": pixels.tobytes()}
    files["davgswt.json"] = json.dumps(json.loads(files["davgswt.json"]) | {"heights": entry}).encode()
    return zipped(files)


def patched(at: int, form: str, value: int):
    """A zip with another number in the record of its end."""

    def spoil(folder) -> bytes:
        data = bytearray(zipped(files_of(folder)))
        struct.pack_into(form, data, len(data) - 22 + at, value)
        return bytes(data)

    return spoil


def boastful(folder) -> bytes:
    """A zip whose manifest claims two gigabytes in some bytes."""
    data = bytearray(zipped({"davgswt.json": b"{}"}))
    struct.pack_into("<I", data, data.rindex(b"PK\x01\x02") + 24, 2_000_000_000)
    return bytes(data)


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
    "spoil, message",
    [
        pytest.param(with_values("tile_side", value="1e999"), "“tile_side” is missing or makes no", id="infinite side"),
        pytest.param(with_values("tile_side", value=1e300), "“tile_side” is missing or makes no", id="huge side"),
        pytest.param(with_values("eye_floor", value=-1), "“eye_floor” is missing or makes no", id="negative eye"),
        pytest.param(with_values("ground_colour", value=[1e30] * 3), "“ground_colour” is missing", id="bright ground"),
        pytest.param(with_values("encoding", "log_scale", value=[0, 9]), "“encoding” is missing", id="huge splats"),
        pytest.param(with_values("encoding", "origin", value=[0, 0, 1e308]), "“encoding” is missing", id="far splats"),
        pytest.param(with_values("encoding", "step", value=[-1, 1, 1]), "“encoding” is missing", id="mirrored grid"),
        pytest.param(with_values("directions", 2, value=[0, 0, 0]), "“directions” is missing", id="no direction"),
        pytest.param(with_values("directions", value=[[0, 0, -1]] * 256), "“directions” is missing", id="directions"),
        pytest.param(with_values("tiles", 3, "z", value=[2, 1]), "tile 3 is missing or makes no", id="z upside down"),
        pytest.param(with_values("tiles", value=[{}] * 4096), "“tiles” is missing or makes no", id="too many tiles"),
        pytest.param(with_values("levels", 0, "band", value="1e999"), "“levels” is missing", id="endless band"),
        pytest.param(with_values("unit", value={}), "“unit” is missing or makes no", id="unit"),
        pytest.param(with_values("heights", value={"kind": "hills"}), "“heights” is missing", id="hills"),
        pytest.param(with_values("sky", "zenith", value=None), "“sky” is missing", id="no sky"),
        pytest.param(with_chunk(count=-64), "contradicts itself", id="negative count"),
        pytest.param(with_chunk(count=0, bytes=0), "contradicts itself", id="nothing in it"),
        pytest.param(with_chunk(count=2**40, bytes=2**40 * 52), "more than this page holds", id="huge count"),
        pytest.param(with_chunk(orders=[0] * 9), "contradicts itself", id="an order nine times"),
        pytest.param(with_chunk(orders=[*range(8), 9]), "contradicts itself", id="an order of no direction"),
        pytest.param(with_chunk(sha256="none"), "contradicts itself", id="no digest"),
        pytest.param(with_chunk(file="../" * 9 + "x"), "contradicts itself", id="a file above"),
        pytest.param(with_order(beyond), "an order does not hold every splat once", id="order beyond the chunk"),
        pytest.param(with_order(in_a_loop), "an order does not hold every splat once", id="order with a loop"),
        pytest.param(with_relief, "heights.bin: a height is not finite", id="NaN in the relief"),
        pytest.param(boastful, "contradicts its own size", id="declared size"),
        pytest.param(lambda f: zipped({"davgswt.json": b" " * 2**27}), "is too large for what it is", id="real bomb"),
        pytest.param(patched(10, "<H", 5000), "5000 entries, at most 4096", id="too many entries"),
        pytest.param(patched(10, "<H", 4000), "its table is damaged", id="more entries than there are"),
        pytest.param(patched(12, "<I", 2**31), "its table lies outside of it", id="table beyond the file"),
        pytest.param(patched(16, "<I", 7), "its table is damaged", id="table elsewhere"),
        pytest.param(lambda f: zipped({"a\\..\\davgswt.json": b"{}"}), "leads out of it", id="backslash"),
        pytest.param(lambda f: zipped({"c:davgswt.json": b"{}"}), "leads out of it", id="drive"),
        pytest.param(lambda f: tiles_of(b"ply\n", 272), "272 tiles, this page shows 256", id="tiles of a set"),
        pytest.param(lambda f: tiles_of(ply_header(10**12, *PLY_NAMES)), "cut short or too long", id="PLY count"),
        pytest.param(lambda f: tiles_of(ply_header(-1, *PLY_NAMES)), "it has no splats", id="PLY without splats"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(x=1e30)), "too far away or too large", id="PLY afar"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(scale_1=700)), "too far away or too la", id="PLY haze"),
        pytest.param(lambda f: tiles_of(splat(), first=splat(x=np.nan)), "a value that is not finite", id="PLY NaN"),
        pytest.param(lambda f: zipped(files_of(f))[:-400], "its end is missing", id="truncated"),
        pytest.param(lambda f: b"no zip at all", "its end is missing", id="no zip"),
        pytest.param(lambda f: zipped({"../davgswt.json": b"{}"}), "“../davgswt.json” leads out of it", id="escapes"),
        pytest.param(lambda f: zipped({"/etc/davgswt.json": b"{}"}), "leads out of it", id="absolute"),
        pytest.param(lambda f: zipped({"readme.txt": b"hello"}), "There is no terrain in what was dropped", id="other"),
        pytest.param(lambda f: with_manifest(f, version=99), "version 99, this page reads version", id="version"),
        pytest.param(lambda f: without(f, "chunks/lod0_tile_03.bin"), "is not among the dropped files", id="no chunk"),
        pytest.param(lambda f: zipped({"lod0_tile_00.ply": b"ply\n"}), "a multiple of 16 is needed", id="one tile"),
        pytest.param(shrunk, "is larger than the table says", id="bomb"),
        pytest.param(flipped, "is damaged", id="flipped"),
    ],
)
def test_what_is_wrong_with_a_dropped_zip_is_said(target, other, spoil, message):
    assert message in said(target, spoil(other))
    assert not target.page.get_by_role("alert").is_visible(), "a click takes the message away"


def test_the_page_still_opens_what_is_sound(target, other):
    """After all that was refused; and what a manifest says besides is left aside, however deep it is."""
    opened = target.page.evaluate("davgswt.state.opened")
    files = files_of(other)
    deep = "[" * 100_000 + "]" * 100_000
    files["davgswt.json"] = files["davgswt.json"].replace(b'"provenance": {}', f'"provenance": {deep}'.encode())
    drop(target, "bundle.zip", zipped(files))
    target.until(f"davgswt.state.opened === {opened + 1}")
    assert not target.page.get_by_role("alert").is_visible()


@pytest.mark.parametrize("place", ["%", "1e300,-1e300,1,0,0", "NaN,Infinity", "%2c,%2c"])
def test_an_address_that_is_no_place_is_passed_over(visit, plain, place):
    seen = visit(160, 100).open(f"{plain}?still#{place}")
    assert np.isfinite([seen.state[key] for key in ("x", "y", "eye", "yaw", "pitch")]).all()
    assert max(abs(seen.state["x"]), abs(seen.state["y"])) < 10


def test_a_dropped_fly_path_is_played(visit, plain):
    seen = visit(160, 100).open(plain)
    place = dict(eye=2.0, yaw=20.0, pitch=-30.0)
    path = [dict(seconds=0.0, x=0.0, y=0.0, **place), dict(seconds=0.3, x=8.0, y=4.0, **place)]
    drop(seen, "flight.json", json.dumps({"format": "davgswt-flight", "path": path}).encode())
    seen.until("davgswt.flyPath.path.length === 2")
    seen.page.evaluate("davgswt.flyPath.play()")
    seen.until("davgswt.state.x === 8 && davgswt.state.y === 4 && davgswt.flyPath.mode === 'rest'")


def test_a_broken_fly_path_is_refused(visit, plain):
    seen = visit(320, 200).open(f"{plain}?still")
    drop(seen, "flight.json", b'{"path": 3}')
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert "not a fly path" in alert.inner_text()
