"""What everybody does on the page, in Chromium and in Firefox: first view, walk, overlay, share, save, photo, video."""

import base64
import io
import json

import numpy as np
import pytest
from fixtures import bundles
from fixtures.page_visit import VIEWER, Visit
from PIL import Image

from dav_gswt.images.jpeg import encode_jpeg
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.page_front import Front

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
SAVED = """window.saved = [];
HTMLAnchorElement.prototype.click = function () { // what a person would find among the downloads
  window.saved.push({ name: this.download, href: this.href });
};
const make = URL.createObjectURL;
URL.createObjectURL = (blob) => {
  const href = make(blob);
  const reader = new FileReader();
  reader.onload = () => (window.blobs = { ...window.blobs, [href]: reader.result.split(",")[1] });
  reader.readAsDataURL(blob);
  return href;
};"""


@pytest.fixture(scope="module")
def fronted(tmp_path_factory):
    """The address of a page with a front; its still is magenta."""
    folder = tmp_path_factory.mktemp("fronted")
    bundles.write_bundle(folder / "bundle", bundles.Ground())
    still = encode_jpeg(np.full((90, 160, 3), [1.0, 0.0, 1.0]), 80)
    write_page(folder / "bundle", VIEWER, folder / "page", front=Front("My meadow", "From 7 photos", still))
    with served(folder / "page") as address:
        yield address


@pytest.fixture(params=["chromium", "firefox"])
def seen(request, fronted):
    """A visit in either browser."""
    browser = request.getfixturevalue(request.param)
    with browser.new_context(viewport={"width": 480, "height": 320}) as context:
        page = context.new_page()
        page.complaints = []
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.add_init_script(SAVED)
        yield Visit(page).open(fronted)
        assert page.complaints == []


def saved(seen, name: str) -> bytes:
    """The file that the page hands over."""
    seen.until(f"saved.some(one => one.name === {json.dumps(name)} && window.blobs?.[one.href])", seconds=60)
    return base64.b64decode(seen.page.evaluate("blobs[saved.at(-1).href]"))


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def test_the_first_view_has_a_name_a_hint_and_a_still_that_fades(seen):
    assert seen.page.title() == "My meadow · From 7 photos"
    seen.until("!hint.hidden")
    seen.until("davgswt.state.whole && !document.getElementById('first')")


def test_keys_walk(seen):
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.locator("#picture").focus()
    seen.page.keyboard.down("w")
    seen.until("davgswt.state.x > 3.3")
    seen.page.keyboard.up("w")
    seen.until("title.classList.contains('leaving') && hint.hidden")
    assert (seen.state["y"] - 5) / (seen.state["x"] - 3) == pytest.approx(0.36397, abs=1e-4)


def test_the_mouse_looks_around(seen):
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.mouse.move(200, 120)
    seen.page.mouse.down()
    seen.page.mouse.move(240, 140, steps=2)
    seen.page.mouse.up()
    assert seen.state["yaw"] == pytest.approx(25) and seen.state["pitch"] == pytest.approx(-27.5)


def test_an_overlay_has_colours_and_a_legend(seen):
    plain = seen.at(**OBLIQUE)
    seen.page.select_option("#overlay", "level")
    painted = seen.picture()
    assert np.abs(painted - plain).mean() > 15
    assert "level 0, finest" in seen.page.locator("#legend").inner_text()
    seen.page.locator("#compare").click()
    both = seen.picture()
    assert (both[:, :240] == plain[:, :240]).all() and (both[:, 240:] == painted[:, 240:]).all()


def test_a_place_is_shared(seen):
    seen.at(**OBLIQUE)
    seen.page.locator("#copyLink").click()
    seen.until("/link to this place is/.test(toast.textContent)")
    assert seen.page.evaluate("location.hash").startswith("#3.0000,5.0000,2.0000,20.000,-30.000")


def test_the_picture_is_saved(seen):
    expected = seen.at(**OBLIQUE)
    seen.page.locator("#keep").click()
    assert (pixels(saved(seen, "my-meadow.png")) == expected).all()


def test_a_photo_is_larger(seen):
    seen.at(**OBLIQUE)
    seen.page.locator("#menuButton").click()
    seen.page.locator("#photoButton").click()
    seen.page.select_option("#photoSize", index=1)
    seen.page.locator("#photoTake").click()
    assert pixels(saved(seen, "my-meadow.png")).shape == (640, 960, 3)


def test_a_video_is_made(seen):
    seen.page.evaluate(
        "path => davgswt.flyPath.load({ format: 'davgswt-flight', version: 1, path })",
        [OBLIQUE | {"seconds": 0}, OBLIQUE | {"seconds": 0.2, "x": 4}],
    )
    seen.page.locator("#menuButton").click()
    seen.until("!video.disabled")
    seen.page.locator("#video").click()
    assert saved(seen, "my-meadow-flight.webm")[:4] == b"\x1a\x45\xdf\xa3"


def test_both_browsers_show_the_same(chromium, firefox, fronted):
    pictures = []
    for browser in (chromium, firefox):
        with browser.new_context(viewport={"width": 320, "height": 200}) as context:
            pictures.append(Visit(context.new_page()).open(f"{fronted}?still").at(**OBLIQUE))
    # rasterizers differ at the edges of splats, and sums by a step of 8 bits
    assert 10 * np.log10(255**2 / np.mean((pictures[0] - pictures[1]) ** 2)) > 45 and pictures[0].std() > 10
