"""A gallery shows every terrain with its still, verdict and size, and nothing of a page becomes HTML."""

import json
from pathlib import Path

import pytest

from dav_gswt.errors import InputError
from dav_gswt.terrain.gallery import list_entries, write_gallery

TEMPLATES = Path(__file__).parents[3] / "workflow" / "gallery"


@pytest.fixture
def page(tmp_path):
    def make(where, title, **changes):
        folder = tmp_path / where
        folder.mkdir(parents=True)
        (folder / "first.jpg").write_bytes(b"\xff\xd8\xff" + 1_200_000 * b"0")
        (folder / "index.html").write_text("<html>")
        front = {"name": title, "line": "From 5 photos", "verdict": "Well"} | changes
        (folder / "front.json").write_text(json.dumps(front))
        return folder

    return make


def test_every_terrain_has_its_still_verdict_size_and_page(tmp_path, page):
    pages = [page("a", "Desert"), page("b", "Meadow <b>")]
    write_gallery(pages, TEMPLATES, tmp_path / "gallery")
    html = (tmp_path / "gallery" / "index.html").read_text()
    assert '<a href="desert/">' in html and 'src="meadow-b/first.jpg"' in html
    assert "From 5 photos. Well" in html and html.count("1.2 MB") == 2
    assert "Meadow &lt;b&gt;" in html and "<b>" not in html
    assert (tmp_path / "gallery/desert/index.html").is_file() and (tmp_path / "gallery/gallery.css").is_file()


def test_a_gallery_is_replaced_and_nothing_else(tmp_path, page):
    pages, out = [page("a", "Desert")], tmp_path / "gallery"
    for _ in range(2):
        write_gallery(pages, TEMPLATES, out)
    (out / "CNAME").write_text("example.org")
    with pytest.raises(InputError, match=r"CNAME is no part of a gallery, and would be deleted"):
        write_gallery(pages, TEMPLATES, out)
    assert (out / "CNAME").read_text() == "example.org" and (out / "desert/index.html").is_file()


def test_terrains_of_one_name_have_folders_of_their_own(page):
    entries = list_entries([page("a", "Desert"), page("b", "desert"), page("c", "…")])
    assert [entry.folder for entry in entries] == ["desert", "desert-2", "terrain"]


@pytest.mark.parametrize("changes", [{"line": 3}, None])
def test_a_page_without_its_front_is_named(tmp_path, page, changes):
    folder = page("a", "Desert", **(changes or {}))
    if changes is None:
        (folder / "first.jpg").unlink()
    with pytest.raises(InputError, match=r"front\.json.*make (the page|it) again"):
        write_gallery([folder], TEMPLATES, tmp_path / "gallery")
    assert not (tmp_path / "gallery").exists()
