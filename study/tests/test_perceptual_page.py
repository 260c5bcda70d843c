"""The page of the perceptual study, answered by a script in a browser: nobody took part."""

import json
from contextlib import contextmanager

import answer_files
import pytest
from fixtures.browser import served
from fixtures.page_visit import Visit

from dav_gswt.files import read_json
from dav_gswt_study.forced_choice import answers, results

pytestmark = pytest.mark.slow
BRIEF = 0.3  # seconds, instead of five
STORED = "davgswt-2afc-"


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    """A kit of ten pairs: page and key."""
    return answer_files.written(tmp_path_factory.mktemp("kit"), answer_files.drawn(crops=2))


@pytest.fixture
def person(chromium, kit):
    """Open the page, served or as a file; yields it with what was asked for and complained of."""

    @contextmanager
    def come(as_file=False, query="", kit=kit):
        context = chromium.new_context(viewport={"width": 1280, "height": 800}, accept_downloads=True)
        page = context.new_page()
        page.asked, page.complaints = [], []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("console", lambda said: page.complaints.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        with served(kit[0]) as address:
            page.home = kit[0].as_uri() + "/index.html" if as_file else address
            page.goto(page.home + query)
            yield page
        assert not page.complaints
        assert all(url.startswith((page.home.removesuffix("index.html"), "data:", "blob:")) for url in page.asked)
        context.close()

    return come


def begin(page):
    assert page.locator("#begin").is_disabled()
    page.check("#consent")
    page.click("#begin")


def reached(page, number):
    """Wait until that pair's turn has come."""
    Visit(page).until(f"document.getElementById('number').textContent.startsWith('{number} ')")


def shown(page):
    """Wait for the next pair; the names of both pictures."""
    page.wait_for_selector("#pair:not(.away)")
    sources = [page.get_attribute(f"#{side}Picture", "src") for side in ("left", "right")]
    return [source.split("/")[1].removesuffix(".png") for source in sources]


def answer_all(page, key, listed, upto=None):
    """From where the page is: the first crop of a pair is chosen, but the second where it is the floor."""
    start = int(page.inner_text("#number").split()[0]) - 1
    for number, (name, left, right) in list(enumerate(listed))[start:upto]:
        reached(page, number + 1)
        assert shown(page) == [left, right]
        item = key["items"][name]
        chosen = item["pictures"][int(item["b"] == "floor")]
        page.wait_for_timeout(20)  # a picture is on the screen before anybody answers
        side = "left" if chosen == left else "right"
        if number % 3 < 2:  # by one key, by another or by touch
            page.keyboard.press({"left": ["ArrowLeft", "f"], "right": ["ArrowRight", "j"]}[side][number % 3])
        else:
            page.click(f"#{side}")


def saved(page, folder):
    page.wait_for_selector("#end:not([hidden])")
    with page.expect_download() as waiting:
        page.click("#save")
    path = folder / waiting.value.suggested_filename
    waiting.value.save_as(path)
    return path


def test_all_trials_answered_are_saved_and_analysed(person, kit, tmp_path):
    key = read_json(kit[1])
    with person(as_file=True, query="?list=5") as page:
        begin(page)
        answer_all(page, key, key["lists"][5])
        path = saved(page, tmp_path)
    told = json.loads(path.read_text())
    assert path.name == f"2afc_{told['participant']}.json" and told["list"] == 5
    assert told["screen"]["width"] == 1280 and told["screen"]["picture"] == 512
    assert all(one["seen"] == 1 and 0 < one["ms"] < 60000 for one in told["answers"])
    people = answers.read_answers([str(path)], key, answer_files.SCHEMA)
    assert people.facts == {"files": 1, "copies": 0, "incomplete": 0, "attention": 0, "participants": 1}
    rows = results.tabulate_choices(key, people.participants)
    shares = {row["second"]: row["share"] for row in rows if row["scene"] == "every"}
    assert shares == {"colour": 1.0, "floor": 0.0}


def test_a_page_that_is_loaded_again_goes_on_and_says_what_was_seen_twice(person, kit, tmp_path):
    key = read_json(kit[1])
    with person(query="?list=2") as page:
        begin(page)
        answer_all(page, key, key["lists"][2], upto=3)
        reached(page, 4)
        shown(page)
        before = page.evaluate(f"JSON.parse(localStorage.getItem({STORED!r} + STUDY.study))")
        page.reload()
        assert page.inner_text("#done") == "3" and page.locator("#begin").is_hidden()
        page.click("#resume")
        answer_all(page, key, key["lists"][2])
        page.wait_for_selector("#end:not([hidden])")
        page.reload()  # nor are answers lost that were not saved yet
        told = json.loads(saved(page, tmp_path).read_text())
    assert told["participant"] == before["participant"] and len(told["answers"]) == len(key["lists"][2])
    assert [one["seen"] for one in told["answers"]] == [1, 1, 1, 2] + [1] * (len(told["answers"]) - 4)


def test_pictures_go_after_their_time_and_may_be_answered_then(person, tmp_path):
    brief = answer_files.written(tmp_path, answer_files.drawn(crops=2), seconds=BRIEF)
    with person(kit=brief) as page:
        begin(page)
        Visit(page).until("current && current.gone")
        assert not page.locator("#leftPicture").is_visible() and page.locator("#question").is_visible()
        page.keyboard.press("ArrowLeft")
        reached(page, 2)
        (one,) = page.evaluate("session.answers")
    assert one["gone"] and one["ms"] >= 1000 * BRIEF - 20 and one["choice"] == "left"
