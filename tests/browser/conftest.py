"""Synthetic bundles as served pages, and visits to them, shared where a test changes nothing but the place."""

from pathlib import Path

import numpy as np
import pytest
from fixtures import bundles, firefox_start, paint_pages
from fixtures.land_covers import write_cover_bundle
from fixtures.page_visit import VIEWER, Visit

from dav_gswt.files import read_json, write_json
from dav_gswt.images.jpeg import encode_jpeg
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.page import Front, write_page


@pytest.fixture(scope="session")
def page_of(tmp_path_factory):
    """Make the page folder of a synthetic ground. edit: changes its manifest in place."""

    def make(ground: bundles.Ground, rows_of=None, surface=None, edit=None) -> Path:
        folder = tmp_path_factory.mktemp("page")
        bundles.write_bundle(folder / "bundle", ground, rows_of)
        write_page(folder / "bundle", VIEWER, folder / "page", surface)
        if edit:
            edit(manifest := read_json(folder / "page/davgswt.json"))
            write_json(folder / "page/davgswt.json", manifest)
        return folder / "page"

    return make


@pytest.fixture(scope="session")
def plain(page_of):
    """The address of a page with 5120 Gaussians, one plain colour a tile."""
    with served(page_of(bundles.Ground())) as address:
        yield address


@pytest.fixture(scope="session")
def blank(chromium):
    """Open tabs beside the viewer's modules that show no page: for tests that import one and call it."""
    contexts = []

    def start(address: str):
        contexts.append(chromium.new_context())
        tab = contexts[-1].new_page()
        tab.route("**/blank.html", lambda route: route.fulfill(body="<!doctype html>", content_type="text/html"))
        tab.goto(f"{address}blank.html")
        return tab

    yield start
    for context in contexts:
        context.close()


@pytest.fixture(scope="session")
def modules(blank, plain):
    """A tab beside the modules of the page of plain colours."""
    return blank(plain)


@pytest.fixture(scope="session")
def call(modules):
    """Call a function of one of the viewer's modules."""

    def run(module: str, name: str, *given):
        act = "async ([module, name, given]) => (await import(`./${module}`))[name](...given)"
        return modules.evaluate(act, [module, name, list(given)])

    return run


@pytest.fixture(scope="session")
def fronted(tmp_path_factory):
    """The address of a page with a front; its still is magenta."""
    folder = tmp_path_factory.mktemp("fronted")
    bundles.write_bundle(folder / "bundle", bundles.Ground())
    still = encode_jpeg(np.full((90, 160, 3), [1.0, 0.0, 1.0]), 80)
    write_page(folder / "bundle", VIEWER, folder / "page", front=Front("My meadow", "From 7 photos", still))
    with served(folder / "page") as address:
        yield address


@pytest.fixture(scope="session")
def still(chromium):
    """Visits to `?still` pages that tests share: one for each address and size of the canvas."""
    visits, contexts = {}, []

    def start(address: str, width: int = 320, height: int = 200) -> Visit:
        key = address, width, height
        if key not in visits:
            contexts.append(chromium.new_context(viewport={"width": width, "height": height}))
            visits[key] = Visit(contexts[-1].new_page()).open(f"{address}?still")
        visits[key].page.evaluate("davgswt.overlay('picture')")
        return visits[key]

    yield start
    for context in contexts:
        context.close()


@pytest.fixture(scope="session")
def firefox(playwright, tmp_path_factory):
    """Debian's Firefox, which draws in software on a display in memory."""
    if reason := firefox_start.missing():
        pytest.skip(reason)
    with firefox_start.started(playwright, tmp_path_factory.mktemp("firefox")) as browser:
        yield browser


@pytest.fixture
def visit(chromium):
    """Start visits; each has a small canvas and knows nothing of the others."""
    contexts = []

    def start(width: int = 320, height: int = 200, **options) -> Visit:
        contexts.append(chromium.new_context(viewport={"width": width, "height": height}, **options))
        return Visit(contexts[-1].new_page())

    yield start
    for context in contexts:
        context.close()


@pytest.fixture(scope="session")
def slow_device():
    """A script that makes a device of the browser on which every slice of a picture takes long: fences pass late."""
    return """const ask = WebGL2RenderingContext.prototype.getSyncParameter, born = new WeakMap();
    WebGL2RenderingContext.prototype.getSyncParameter = function (sync, name) {
      if (!born.has(sync)) born.set(sync, performance.now());
      return performance.now() - born.get(sync) < 150 ? this.UNSIGNALED : ask.call(this, sync, name);
    };"""


@pytest.fixture(scope="module")
def target(chromium, plain):
    """A visit that one broken zip after the other is dropped onto."""
    with chromium.new_context(viewport={"width": 320, "height": 200}) as context:
        yield Visit(context.new_page()).open(f"{plain}?still")


@pytest.fixture(scope="module")
def cover(tmp_path_factory):
    """The folder of a page of sand and grass with shrubs, on level ground."""
    folder = tmp_path_factory.mktemp("cover")
    write_cover_bundle(folder / "bundle", paint_pages.SCHEMA)
    write_page(folder / "bundle", VIEWER, folder / "page")
    return folder


@pytest.fixture(scope="module")
def address(cover):
    with served(cover / "page") as found:
        yield found


@pytest.fixture
def seen(still, address):
    """A shared visit, as the bundle was made."""
    found = still(address, 240, 240)
    found.page.evaluate("davgswt.painting.load(davgswt.painting.blank)")
    yield found
    found.page.evaluate("davgswt.paint.brush.material = null")
