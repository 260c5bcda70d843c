"""Loading: progress in bytes, nothing from outside, and a readable message for everything that can be wrong."""

import json
import re

import pytest
from fixtures.bundles import Ground

from dav_gswt.study.terrain.browser import served


def test_progress_is_said_in_bytes_and_coarse_levels_come_first(visit, plain):
    seen = visit(160, 100)
    asked, held = [], []

    def watch(route):
        name = route.request.url.rsplit("/", 1)[-1]
        asked.append(name)
        if name == "lod0_tile_09.bin" and not held:
            held.append(route)
        else:
            route.continue_()

    seen.page.route("**/chunks/*", watch)
    seen.open(plain, wait=False)
    seen.until("davgswt.state.drawn.length > 0 && !davgswt.state.loaded")
    status = seen.page.locator("#status")
    while len(asked) < 32:
        seen.page.wait_for_timeout(20)
    assert re.fullmatch(r"Loading \d+\.\d of 0\.2 MB", status.inner_text())
    assert seen.page.evaluate("bar.value") < 1
    assert all(name.startswith("lod1") for name in asked[:16])
    held[0].continue_()
    seen.page.evaluate("davgswt.ready.then(() => 0)")
    assert not seen.page.locator("#loading").is_visible()


def test_no_request_leaves_the_page_and_nothing_is_complained_about(visit, plain):
    seen = visit(160, 100)
    asked, complaints = [], []
    seen.page.on("request", lambda request: asked.append(request.url))
    seen.page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    seen.page.on("pageerror", lambda error: complaints.append(str(error)))
    seen.open(plain)
    assert complaints == []
    assert {url.startswith((plain, "data:")) for url in asked} == {True}
    assert len(asked) > 32


def spoil_manifest(**changes):
    def spoil(folder):
        path = folder / "davgswt.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))

    return spoil


def cut(folder):
    path = folder / "chunks" / "lod1_tile_03.bin"
    path.write_bytes(path.read_bytes()[:-100])


def lengthen(folder):
    path = folder / "chunks" / "lod1_tile_03.bin"
    path.write_bytes(path.read_bytes() + b"more")


def damage(folder):
    path = folder / "chunks" / "lod0_tile_07.bin"
    data = bytearray(path.read_bytes())
    data[100] ^= 1
    path.write_bytes(data)


def point_outside(folder):
    path = folder / "davgswt.json"
    path.write_text(path.read_text().replace("chunks/lod0_tile_00.bin", "https://example.org/x.bin"))


@pytest.mark.parametrize(
    "spoil, message",
    [
        pytest.param(
            lambda f: (f / "chunks/lod0_tile_02.bin").unlink(), "lod0_tile_02.bin is not there", id="no chunk"
        ),
        pytest.param(spoil_manifest(version=1), "version 1, this page reads version 2 and 3", id="version"),
        pytest.param(spoil_manifest(format="ply"), "not a terrain", id="format"),
        pytest.param(lambda f: (f / "davgswt.json").write_text("{"), "davgswt.json is not readable", id="not JSON"),
        pytest.param(spoil_manifest(tile_side=0), "“tile_side” is missing or makes no sense", id="tile side"),
        pytest.param(spoil_manifest(encoding={}), "“encoding” is missing or makes no sense", id="encoding"),
        pytest.param(spoil_manifest(tiles=[]), "“tiles” is missing or makes no sense", id="no tiles"),
        pytest.param(spoil_manifest(materials=[]), "“materials” is missing or makes no sense", id="no material"),
        pytest.param(spoil_manifest(objects=[{}]), "“objects” is missing or makes no sense", id="an object"),
        pytest.param(spoil_manifest(levels=[None]), "“levels” is missing or makes no sense", id="levels"),
        pytest.param(cut, "lod1_tile_03.bin is cut short: 2", id="cut short"),
        pytest.param(lengthen, "lod1_tile_03.bin is too long", id="too long"),
        pytest.param(damage, "lod0_tile_07.bin is damaged", id="damaged"),
        pytest.param(point_outside, "“https://example.org/x.bin” contradicts itself", id="points outside"),
    ],
)
def test_a_spoilt_bundle_is_named_with_what_to_do(visit, page_of, spoil, message):
    folder = page_of(Ground(discs=4))
    if spoil is cut or spoil is lengthen:
        folder = page_of(Ground())
    spoil(folder)
    with served(folder) as address:
        assert_said(visit(480, 300), address, message)


def test_a_missing_manifest_is_named(visit, page_of):
    folder = page_of(Ground(discs=4))
    with served(folder) as address:
        (folder / "davgswt.json").unlink()
        assert_said(visit(480, 300), address, "davgswt.json is not there (the server answered 404)")


def test_a_server_that_went_away_is_named(visit, plain):
    seen = visit(480, 300)
    seen.page.route("**/davgswt.json", lambda route: route.abort())
    assert_said(seen, plain, "davgswt.json cannot be reached. Is “make view” still running?")


def test_a_browser_without_webgl2_is_told(visit, plain):
    seen = visit(480, 300)
    seen.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    assert_said(seen, plain, "no WebGL2")


def assert_said(seen, address, message):
    """The page shows one message as an alert, nothing is left spinning, and `ready` is rejected."""
    seen.open(address, wait=False)
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert message in alert.inner_text()
    assert not seen.page.locator("#loading").is_visible()
    assert seen.page.evaluate("davgswt.ready.then(() => 'ready', () => 'refused')") == "refused"
