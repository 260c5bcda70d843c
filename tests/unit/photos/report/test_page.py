"""The report on a scene's photos: what it counts and warns of, and that it needs nothing but itself."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.geometry.scene_frame import FocalLength, LeftOutPhoto, Square
from dav_gswt.photos.colmap_model import transform_model
from dav_gswt.photos.folder import write_photo_folder
from dav_gswt.photos.report.facts import PhotoFacts, collect_facts, find_weaknesses
from dav_gswt.photos.report.figures import camera_footprint
from dav_gswt.photos.report.page import write_report

FRAME = scene_frame(
    kind="photos",
    unit="flying height",
    flying_height=1.0,
    exemplar=(-0.5, -0.5, 1.0),
    extent=(-1.0, -1.0, 1.0, 1.0),
    photos_per_cell=3,
    relief=0.01,
    images=14,
    registered=12,
    left_out=(LeftOutPhoto("<b>bold</b>.jpg", "it matches <i>no</i> photo & nothing else"),),
    focal_ratio=1.0,
    focal=FocalLength(300.0, 300.0, 303.0, 30.0, "EXIF's, which the photos confirm"),
    reprojection_error=0.4,
    points=3000,
)
SCENE = 'dunes "<&>"'
GREY = np.full((12, 16, 3), 0.5, np.float32)


def segment(colour):
    """Two kinds of ground, in the west and in the east."""
    return (np.arange(colour.shape[1]) > 0.6 * colour.shape[1]).astype(int) * np.ones(len(colour), int)[:, None]


@pytest.fixture(scope="module")
def flown():
    """Twelve photos in three flight lines of four; the last is held by few points, and another's are off."""
    sparse = synth.model(synth.flight(3, 4), synth.plain(3000, 0.9, np.random.default_rng(1)))
    last, off = sparse.image_of == 11, sparse.image_of == 4
    keep = ~last | (np.cumsum(last) <= 25)
    moved = sparse.pixels + np.where(off, 3.0, 0.0)[:, None] * [1, 0]
    names = ('<img src="x">&.png', *sparse.names[1:])
    sparse = replace(sparse, names=names, pixels=moved)
    return replace(sparse, **{k: getattr(sparse, k)[keep] for k in ("point_of", "image_of", "pixels")})


@pytest.fixture(scope="module")
def made(flown, tmp_path_factory):
    """Writes a photos/ folder; its pictures are small."""

    def make(frame=FRAME, sparse=flown):
        folder = tmp_path_factory.mktemp("made") / "photos"
        write_photo_folder(folder, sparse, ((name, GREY) for name in sparse.names), frame, None, None)
        return folder

    return make


@pytest.fixture(scope="module")
def facts(made):
    return collect_facts(made(), SCENE)


@pytest.fixture(scope="module")
def page(root, tmp_path_factory):
    """Writes a report and returns its text."""

    def write(photos):
        out = tmp_path_factory.mktemp("page") / "report.html"
        write_report(photos, root / "workflow" / "report" / "photos.html", SCENE, out, segment)
        return out.read_text()

    return write


@pytest.fixture(scope="module")
def text(page, made):
    return page(made())


class Seen(HTMLParser):
    """What a page links to, its ids and its words."""

    def __init__(self, text):
        super().__init__()
        self.links, self.ids, self.words = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.links += [v for k, v in attributes if k in ("href", "src", "action", "data", "srcset")]
        self.ids += [v for k, v in attributes if k == "id"]

    def handle_data(self, text):
        self.words.append(text)


def test_the_page_needs_nothing_but_itself(text, page, made):
    seen = Seen(text)
    assert len(set(seen.ids)) == len(seen.ids)
    inner = {link[1:] for link in seen.links if link.startswith("#")}
    assert inner == {f"photo-{i}" for i in range(12)} <= set(seen.ids)
    assert all(link.startswith(("data:image/", "#")) for link in seen.links)
    assert "default-src 'none'" in text and not re.search(r"url\(|@import|<script|https?:", text)
    assert text == page(made()), "equal photos give equal bytes"


def test_what_files_and_config_say_is_text_and_no_markup(text):
    assert not {"<b>", "<i>", '<img src="x">'} & set(re.findall(r"<[^>]*>", text))
    words = " ".join(Seen(text).words)
    assert SCENE in words and "<b>bold</b>.jpg" in words and '<img src="x">&.png' in words
    assert "it matches <i>no</i> photo & nothing else" in words


@pytest.mark.parametrize(
    "points, error, shared, said",
    [
        (100, 2.0, 30, ()),
        (1000, None, 400, ()),
        (99, 0.5, 60, ("held by 99 points only, others by about 300",)),
        (1000, np.inf, 400, ("its points are inf px off on average",)),
        (1000, 2.1, 29, ("its points are 2.1 px off on average", "shares at most 29 points with any other photo")),
    ],
)
def test_what_makes_a_photo_weak(points, error, shared, said):
    photo = PhotoFacts("a", points, error, 1.0, 0.0, "b", shared, 3, False, ())
    assert find_weaknesses(photo, 300.0) == said


def test_coverage_does_not_depend_on_the_unit(facts, made, flown):
    """A world in metres, 40 of them a flying height: the same photos see the same places."""
    metres = transform_model(flown, 40.0, np.eye(3), np.zeros(3))
    frame = replace(FRAME, unit="metre", flying_height=40.0, exemplar=Square(-20.0, -20.0, 40.0))
    two = collect_facts(made(frame, metres), SCENE)
    assert np.array_equal(facts.cover.counts, two.cover.counts)
    assert two.cover.cell == pytest.approx(40 * facts.cover.cell)
    assert two.cover.west == pytest.approx(40 * facts.cover.west)


def test_a_footprint_by_hand():
    """From height 2 a picture of 320 x 240 at focal length 300 covers 640 / 300 by 480 / 300."""
    outline = camera_footprint(synth.camera((1, 0, 2)), 9.0)
    assert np.ptp(outline, axis=0) == pytest.approx([640 / 300, 480 / 300])
    assert (outline.max(0) + outline.min(0)) / 2 == pytest.approx([1, 0])
    outline = camera_footprint(synth.camera((0, 0, 1), (1, 0, 1)), 3.0)  # over the horizon it ends in reach
    assert np.linalg.norm(outline, axis=1).max() <= 3.0 + 1e-9 and np.isfinite(outline).all()


def test_photos_that_only_test_do_not_count(made, flown):
    own = flown.image_of < 8
    sparse = replace(flown, **{k: getattr(flown, k)[own] for k in ("point_of", "image_of", "pixels")})
    frame = replace(FRAME, kind="synthetic", test=flown.names[8:], left_out=(), focal_ratio=None)
    found = collect_facts(made(frame, sparse), SCENE)
    assert found.cover.counts.max() <= 8 and len(found.placed) == 8
    assert not any(photo.weak for photo in found.photos if photo.tests)
