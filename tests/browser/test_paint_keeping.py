"""Painted materials that are kept in a link or a file."""

import json

import numpy as np
import pytest
from fixtures.dropped_files import drop
from fixtures.paint_pages import ABOVE, BLANK, paint


def test_a_link_restores_what_was_painted_and_set_to_the_bit(seen, visit, address):
    seen.at(**ABOVE)
    paint(seen, 4.0, 7.0, 3.0, 1)
    paint(seen, -9.0, -3.0, 1.0, 0)
    seen.page.evaluate("davgswt.painting.setDensity(0, 2, true)")
    seen.page.evaluate("davgswt.painting.setOffsets([0.03, -0.03], true)")
    painted = seen.picture()
    link = seen.page.evaluate("davgswt.paint.keep.findLink()")
    assert 0 < len(link) < 400
    fresh = visit(240, 240).open(f"{address}?still#6,5,20,90,-90&paint={link}")
    assert fresh.state["y"] == 5.0 and fresh.state["pitch"] == -90.0
    assert (fresh.picture() == painted).all()
    assert fresh.page.evaluate("davgswt.paint.keep.findLink()") == link
    assert not fresh.page.evaluate("davgswt.painting.canUndo")


def test_the_address_follows_what_is_painted_and_a_pasted_one_is_followed(visit, address):
    seen = visit(120, 80).open(address)
    paint(seen, 3.0, 3.0, 1.0, 1)
    seen.until("location.hash.includes('&paint=')")
    link = seen.page.evaluate("location.hash.split('&paint=')[1]")
    count = seen.page.evaluate("davgswt.painting.painted.count")
    seen.page.evaluate("davgswt.painting.undo()")
    seen.until("!location.hash.includes('paint')")
    seen.page.evaluate("link => { location.hash = `#1,1,2,0,-20&paint=${link}` }", link)
    seen.until(f"davgswt.painting.painted.count === {count}")


@pytest.mark.parametrize(
    "link, message",
    [
        pytest.param("AAAA", "cut short or changed", id="cut"),
        pytest.param("a" * 20_000, "cut short or changed", id="long"),
        pytest.param("%00<b>", "cut short or changed", id="letters"),
    ],
)
def test_a_broken_link_is_told_and_the_terrain_is_there(visit, address, link, message):
    seen = visit(120, 80).open(f"{address}?still#1,1,2,0,-20&paint={link}")
    assert message in seen.page.get_by_role("alert").inner_text()
    assert seen.state["loaded"] and seen.page.evaluate("davgswt.painting.painted.count") == 0


def test_too_much_for_a_link_is_told_and_goes_into_a_file(seen):
    noise = np.random.default_rng(0).integers(0, [30, 20, 2], (12_000, 3)).tolist()
    runs = [[40 * (k % 200) + i, k // 200, 1 + length, m] for k, (i, length, m) in enumerate(noise)]
    runs = [[i, j, min(length, 40 - i % 40), m] for i, j, length, m in runs]
    seen.page.evaluate("paint => davgswt.paint.keep.load(paint)", BLANK | {"runs": runs})
    assert seen.page.evaluate("davgswt.paint.keep.findLink()") is None
    seen.until("document.getElementById('paintStatus').textContent.includes('Save it as a file')")


def test_a_saved_file_restores_what_was_painted_and_set(seen, visit, address):
    seen.at(**ABOVE)
    paint(seen, 4.0, 7.0, 3.0, 1)
    seen.page.evaluate("davgswt.painting.setDensity(0, 0.5, true)")
    painted = seen.picture()
    with seen.page.expect_download() as download:
        seen.page.locator("#savePaint").dispatch_event("click")
    data = download.value.path().read_bytes()
    fresh = visit(240, 240).open(f"{address}?still")
    fresh.at(**ABOVE)
    fresh.page.set_input_files("#paintFile", {"name": "p.json", "mimeType": "application/json", "buffer": data})
    fresh.until("davgswt.painting.painted.count > 0")
    assert (fresh.picture() == painted).all()
    fresh.page.evaluate("davgswt.painting.undo()")
    assert fresh.page.evaluate("davgswt.painting.painted.count") == 0
    drop(fresh, "p.json", data)
    fresh.until("davgswt.painting.painted.count > 0")
    assert (fresh.picture() == painted).all()


@pytest.mark.parametrize(
    "change, message",
    [
        pytest.param({"version": 7}, "version 7", id="version"),
        pytest.param({"materials": ["sand", 3]}, "“materials”", id="names"),
        pytest.param({"runs": [[0, 0, 1]]}, "“runs”", id="short run"),
        pytest.param({"runs": [[0, 0.5, 1, 0]]}, "“runs”", id="half a place"),
        pytest.param({"runs": [[0, 0, -3, 0]]}, "“runs”", id="negative run"),
        pytest.param({"runs": [[2**40, 0, 1, 0]]}, "“runs”", id="far run"),
        pytest.param({"runs": [[0, k, 2**18, 0] for k in range(2)]}, "“runs”", id="too many"),
        pytest.param({"runs": [[0, 0, 1, 2]]}, "“runs”", id="material of a run"),
        pytest.param({"runs": {}}, "“runs”", id="no list"),
        pytest.param({"densities": {"shrub": -1}}, "“densities”", id="density"),
        pytest.param({"densities": []}, "“densities”", id="list of densities"),
        pytest.param({"offsets": {"sand": 99}}, "“offsets”", id="offset"),
        pytest.param({"materials": ["mud", "grass"], "runs": [[0, 0, 1, 0]]}, "“mud”", id="other materials"),
        pytest.param({"format": "x"}, "not a fly path", id="another file"),
    ],
)
def test_a_bad_file_is_told_and_changes_nothing(seen, change, message):
    drop(seen, "painted.json", json.dumps(BLANK | change).encode())
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    text = alert.inner_text()
    alert.click()
    assert message in text
    assert seen.page.evaluate("davgswt.painting.painted.count") == 0
