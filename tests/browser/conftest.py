"""Synthetic bundles as served pages, and visits to them, shared where a test changes nothing but the place."""

from pathlib import Path

import pytest
from fixtures import bundles, firefox_start, paint_pages
from fixtures.land_covers import write_cover_bundle
from fixtures.page_visit import VIEWER, Visit

from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.page import write_page


@pytest.fixture(scope="session")
def page_of(tmp_path_factory):
    """Make the page folder of a synthetic ground."""

    def make(ground: bundles.Ground, rows_of=None, surface=None) -> Path:
        folder = tmp_path_factory.mktemp("page")
        bundles.write_bundle(folder / "bundle", ground, rows_of)
        write_page(folder / "bundle", VIEWER, folder / "page", surface)
        return folder / "page"

    return make


@pytest.fixture(scope="session")
def plain(page_of):
    """The address of a page with 5120 Gaussians, one plain colour a tile."""
    with served(page_of(bundles.Ground())) as address:
        yield address


@pytest.fixture(scope="session")
def modules(chromium, plain):
    """A tab beside the viewer's modules that shows no page: for tests that import one and call it."""
    with chromium.new_context() as context:
        tab = context.new_page()
        tab.route("**/blank.html", lambda route: route.fulfill(body="<!doctype html>", content_type="text/html"))
        tab.goto(f"{plain}blank.html")
        yield tab


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
