"""What everybody does on the page, in Firefox: first view, walk, overlay, share, save."""

import base64
import io
import json

import numpy as np
import pytest
from fixtures.page_visit import Visit
from PIL import Image

pytestmark = pytest.mark.slow
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


@pytest.fixture
def seen(firefox, fronted):
    """A visit without complaints."""
    with firefox.new_context(viewport={"width": 480, "height": 320}) as context:
        page, complaints = context.new_page(), []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.add_init_script(SAVED)
        yield Visit(page).open(fronted)
        assert complaints == []


def saved(seen, name: str) -> bytes:
    """The file that the page hands over."""
    seen.until(f"saved.at(-1)?.name === {json.dumps(name)} && window.blobs?.[saved.at(-1).href]", seconds=60)
    data = base64.b64decode(seen.page.evaluate("blobs[saved.at(-1).href]"))
    seen.page.evaluate("saved.length = 0")
    return data


def test_who_visits_walks_looks_around_and_shares_the_place(seen):
    seen.until("!hint.hidden")
    seen.until("davgswt.state.whole && !document.getElementById('first')")
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.locator("#picture").focus()
    seen.page.keyboard.down("w")
    seen.until("davgswt.state.x > 3.3")
    seen.page.keyboard.up("w")
    seen.until("title.classList.contains('leaving') && hint.hidden")
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.mouse.move(200, 120)
    seen.page.mouse.down()
    seen.page.mouse.move(240, 140, steps=2)
    seen.page.mouse.up()
    assert seen.state["yaw"] == pytest.approx(25) and seen.state["pitch"] == pytest.approx(-27.5)
    seen.page.locator("#copyLink").click()
    seen.until("/link to this place is/.test(toast.textContent)")
    assert seen.page.evaluate("location.hash").startswith("#3.0000,5.0000,2.0000,25.000,-27.500")


def test_pictures_are_saved_and_overlays_shown(seen, chromium, fronted):
    plain = seen.at(**OBLIQUE)
    seen.page.locator("#keep").click()
    picture = Image.open(io.BytesIO(saved(seen, "my-meadow.png"))).convert("RGB")
    assert (np.asarray(picture).astype(int) == plain).all()
    seen.page.select_option("#overlay", "level")
    assert np.abs(seen.picture() - plain).mean() > 15
    assert "level 0, finest" in seen.page.locator("#legend").inner_text()
    with chromium.new_context(viewport={"width": 480, "height": 320}) as context:
        other = Visit(context.new_page()).open(f"{fronted}?still").at(**OBLIQUE)
    # rasterizers differ at the edges of splats, and sums by a step of 8 bits
    assert 10 * np.log10(255**2 / np.mean((plain - other) ** 2)) > 45 and plain.std() > 10
