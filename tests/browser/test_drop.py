"""Bundles, sets for the public renderer and fly paths that are dropped onto the page; zips that nobody should trust."""

import base64
import io
import json
import struct
import zipfile

import numpy as np
import pytest
from fixtures import bundles
from fixtures.bundles import Ground
from fixtures.page_visit import Visit

from dav_gswt.bundle import gswt
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.study.terrain.browser import served

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
    bundles.write_bundle(folder, OTHER)
    return folder


@pytest.fixture(scope="module")
def target(chromium, plain):
    """A visit that one broken zip after the other is dropped onto."""
    with chromium.new_context(viewport={"width": 320, "height": 200}) as context:
        yield Visit(context.new_page()).open(f"{plain}?still")


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
          const { sourceOf } = await import("./ui/drop.js");
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
def test_what_is_wrong_with_a_dropped_zip_is_said(target, other, spoil, message):
    seen = target
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
    seen.until("davgswt.flyPath.path.length === 2")
    seen.page.evaluate("davgswt.flyPath.play()")
    seen.until("davgswt.state.x === 8 && davgswt.state.y === 4 && davgswt.flyPath.mode === 'rest'")


def test_a_broken_fly_path_is_refused(visit, plain):
    seen = visit(320, 200).open(f"{plain}?still")
    drop(seen, "flight.json", b'{"path": 3}')
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert "not a fly path" in alert.inner_text()
