"""Bundles, sets for the public renderer and fly paths that are dropped onto the page; zips that nobody should trust."""

import base64
import io
import json
import struct
import zipfile

import made_up
import numpy as np
import pytest
from made_up import Ground
from visiting import served

from dav_gswt.bundle import gswt
from dav_gswt.bundle.store import Bundle

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
OTHER = Ground(discs=8, salt=99, speckle=20)
DROP = """([name, text]) => {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0)), dropped = new DataTransfer();
  dropped.items.add(new File([bytes], name));
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: dropped, bubbles: true, cancelable: true }));
}"""


def drop(seen, name: str, data: bytes) -> None:
    seen.page.evaluate(DROP, [name, base64.b64encode(data).decode()])


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """The folder of another bundle."""
    folder = tmp_path_factory.mktemp("other") / "bundle"
    made_up.write_bundle(folder, OTHER)
    return folder


def zipped(files: dict[str, bytes], method=zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


def files_of(folder, above: str = "") -> dict[str, bytes]:
    return {above + str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


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
    gswt.write(Bundle(other, manifest).fields(), OTHER.side, tmp_path / "gswt.zip")
    seen = visit(160, 100).open(f"{plain}?still")
    drop(seen, "gswt.zip", (tmp_path / "gswt.zip").read_bytes())
    seen.until("davgswt.state.opened === 2")
    picture = seen.at(x=2.0, y=2.0, eye=1.5, yaw=90, pitch=-90)
    # the set's own eye floor keeps the eye so high that hundreds of tiles are in the picture: it has their mean colour
    assert np.abs(picture.mean((0, 1)) - np.mean([made_up.colour_of(t) for t in range(16)], 0)).max() < 4
    assert picture.std() > 5


def test_a_folder_is_found_wherever_its_manifest_lies(visit, plain):
    seen = visit(160, 100).open(f"{plain}?still")
    found = seen.page.evaluate(
        """async () => {
          const { sourceOf } = await import("./drop.js");
          const bytes = (n) => async () => new ArrayBuffer(n);
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


@pytest.mark.parametrize(
    "spoil, message",
    [
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
def test_what_is_wrong_with_a_dropped_zip_is_said(visit, plain, other, spoil, message):
    seen = visit(320, 200).open(f"{plain}?still")
    drop(seen, "bundle.zip", spoil(other))
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert message in alert.inner_text()
    alert.click()
    assert not alert.is_visible(), "a click takes the message away"


def test_a_dropped_fly_path_is_played(visit, plain):
    seen = visit(160, 100).open(plain)
    place = dict(eye=2.0, yaw=20.0, pitch=-30.0)
    path = [dict(seconds=0.0, x=0.0, y=0.0, **place), dict(seconds=0.3, x=8.0, y=4.0, **place)]
    drop(seen, "flight.json", json.dumps({"format": "davgswt-flight", "path": path}).encode())
    seen.until("davgswt.flight.path.length === 2")
    seen.page.evaluate("davgswt.flight.play()")
    seen.until("davgswt.state.x === 8 && davgswt.state.y === 4 && davgswt.flight.mode === 'rest'")


def test_a_broken_fly_path_is_refused(visit, plain):
    seen = visit(320, 200).open(f"{plain}?still")
    drop(seen, "flight.json", b'{"path": 3}')
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert "not a fly path" in alert.inner_text()
