"""The page that a run makes, opened in a browser as a visitor opens it."""

import pytest
from fixtures.page_visit import Visit

from dav_gswt.study.terrain.browser import served

ENOUGH = 150_000  # Gaussians of a picture that has few pixels; software draws it


# the smallest as a visitor sees it, the others drawn when asked: software draws a large one for minutes
@pytest.mark.parametrize(("made", "how"), [("tiny", ""), ("finished", "?still=1000"), ("beach", "?still=1000")])
def test_a_made_page_shows_its_ground(chromium, made, how, request):
    page = chromium.new_context(viewport={"width": 160, "height": 100}).new_page()
    complaints = []
    page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    with served(request.getfixturevalue(made).terrain / "page") as address:
        visit = Visit(page).open(address + how)
        picture = visit.picture(ENOUGH)
    below = picture[picture.shape[0] // 2 :]
    assert not complaints and page.locator("#error").is_hidden()
    assert below.mean() > 40 and below.std() > 2
    assert (below.max(2) < 8).mean() < 0.01
