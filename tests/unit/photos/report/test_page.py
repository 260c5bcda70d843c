"""The report on a scene's photos: what it says, what it warns of, and that it needs nothing but itself."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame
from jinja2 import Environment, meta

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import FocalLength, LeftOutPhoto, SfmSign, SfmVerdict, Square
from dav_gswt.photos.colmap_model import transform_model
from dav_gswt.photos.folder import write_photo_folder
from dav_gswt.photos.report import page as report
from dav_gswt.photos.report.facts import PhotoFacts, collect_facts, find_weaknesses, list_weak_spots
from dav_gswt.photos.report.figures import bin_coverage, camera_footprint, make_thumbnails
from dav_gswt.photos.report.mosaic import GroundKinds
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
    left_out=(
        LeftOutPhoto("<b>bold</b>.jpg", "it matches <i>no</i> photo & nothing else"),
        LeftOutPhoto("blurred.jpg", "it shares 9 points with a placed photo, but its position stays unsure"),
    ),
    focal_ratio=1.0,
    focal=FocalLength(300.0, 300.0, 303.0, 30.0, "EXIF's, which the photos confirm"),
    reprojection_error=0.4,
    points=3000,
)
PLACE = Georeference(-33.5, 151.25, 10.0, north=30.0, metres_per_unit=1.0)


def segment(colour):
    """Two kinds of ground, in the west and in the east."""
    return (np.arange(colour.shape[1]) > 0.6 * colour.shape[1]).astype(int) * np.ones(len(colour), int)[:, None]


SCENE = 'dunes "<&>"'


@pytest.fixture(scope="session")
def flown():
    """Twelve photos in three flight lines of four; the last is held by few points, and another's are off."""
    sparse = synth.model(synth.flight(3, 4), synth.plain(3000, 0.9, np.random.default_rng(1)))
    last, off = sparse.image_of == 11, sparse.image_of == 4
    keep = ~last | (np.cumsum(last) <= 25)
    moved = sparse.pixels + np.where(off, 3.0, 0.0)[:, None] * [1, 0]
    names = ('<img src="x">&.png', *sparse.names[1:])
    sparse = replace(sparse, names=names, pixels=moved)
    return replace(sparse, **{k: getattr(sparse, k)[keep] for k in ("point_of", "image_of", "pixels")})


@pytest.fixture
def made(flown, tmp_path):
    """Writes a photos/ folder."""

    def make(name="photos", frame=FRAME, sparse=flown, covers=None):
        pictures = (
            (n, np.full((c.height, c.width, 3), 0.5)) for n, c in zip(sparse.names, sparse.cameras, strict=True)
        )
        write_photo_folder(tmp_path / name, sparse, pictures, frame, None, covers)
        return tmp_path / name

    return make


@pytest.fixture
def template(root):
    return root / "workflow" / "report" / "photos.html"


@pytest.fixture
def page(template, tmp_path):
    """Writes a report and returns its text."""

    def write(photos):
        write_report(photos, template, SCENE, tmp_path / "report.html", segment)
        return (tmp_path / "report.html").read_text()

    return write


class Seen(HTMLParser):
    """What a page links to, its ids, its words, and whether its tags are closed."""

    EMPTY = {"meta", "img"}

    def __init__(self, text):
        super().__init__()
        self.links, self.ids, self.words, self.open, self.unnamed = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.links += [v for k, v in found.items() if k in ("href", "src", "action", "data", "srcset")]
        self.ids += [found["id"]] if "id" in found else []
        if (tag == "img" and not found.get("alt")) or (tag == "svg" and not found.get("aria-label")):
            self.unnamed.append(tag)
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in self.EMPTY:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        self.words.append(text)


def test_the_page_needs_nothing_but_itself(page, made):
    text = page(made())
    seen = Seen(text)
    assert not seen.open and not seen.unnamed and len(set(seen.ids)) == len(seen.ids)
    inner = {link[1:] for link in seen.links if link.startswith("#")}
    assert inner == {f"photo-{i}" for i in range(12)} <= set(seen.ids)
    assert all(link.startswith(("data:image/", "#")) for link in seen.links)
    assert "default-src 'none'" in text and not re.search(r"url\(|@import|<script|https?:", text)


def test_what_files_and_config_say_is_text_and_no_markup(page, made):
    text = page(made())
    assert not {"<b>", "<i>", '<img src="x">'} & set(re.findall(r"<[^>]*>", text))
    words = " ".join(Seen(text).words)
    assert SCENE in words and "<b>bold</b>.jpg" in words and '<img src="x">&.png' in words
    assert "it matches <i>no</i> photo & nothing else" in words


def test_equal_photos_give_equal_bytes(page, made):
    assert page(made("one")) == page(made("two"))


def test_weak_spots_stand_at_the_top_in_words(page, made):
    words = " ".join(Seen(page(made())).words)
    top = words[: words.index("Where the photos were taken")]
    assert "12 of 14 photos found their place" in top
    assert "2 of 14 photos were left out" in top
    assert "2 photos are weakly placed: 004.png, 011.png" in top
    assert "held by 25 points only" in words and "3.0 px off" in words


def test_a_set_without_weak_spots_says_so(page, made):
    sparse = synth.model(synth.flight(5, 5, 0.2), synth.plain(5000, 0.9, np.random.default_rng(1)))
    frame = replace(FRAME, left_out=(), images=25, registered=25)
    text = page(made(sparse=sparse, frame=frame))
    assert "Nothing is weak" in text and "⚠" not in text and 'id="left-out"' not in text


def test_the_verdict_on_the_cameras_and_what_was_tried_are_listed(page, made):
    signs = SfmSign("tilt", "good", "photos look 5 degrees off"), SfmSign("GPS", "doubtful", "<62> m off")
    verdict = SfmVerdict("doubtful", signs, ("incremental mapping: doubtful", "global mapping: refused"))
    words = " ".join(Seen(page(made(frame=replace(FRAME, verdict=verdict)))).words)
    assert "The cameras are doubtful: <62> m off." in words[: words.index("Where the photos were taken")]
    assert "can be trusted: doubtful" in words and "photos look 5 degrees off" in words
    assert "global mapping: refused" in words


@pytest.mark.parametrize(
    "points, error, shared, said",
    [
        (1000, 0.5, 400, ()),
        (1000, None, 400, ()),
        (99, 0.5, 60, ("held by 99 points only, others by about 300",)),
        (1000, 2.1, 400, ("its points are 2.1 px off on average",)),
        (1000, np.inf, 400, ("its points are inf px off on average",)),
        (1000, 0.5, 29, ("shares at most 29 points with any other photo",)),
    ],
)
def test_what_makes_a_photo_weak(points, error, shared, said):
    photo = PhotoFacts("a", points, error, 1.0, 0.0, "b", shared, 3, False, ())
    assert find_weaknesses(photo, 300.0) == said


@pytest.mark.parametrize(
    "north, part",
    [(None, "upper left part (as on the map)"), (0.0, "north-west part"), (90.0, "north-east part")],
)
def test_a_corner_that_few_photos_see_is_named_by_the_compass_or_the_map(made, flown, north, part):
    """Of twelve photos only three see the corner in the north-west of the sheet."""
    frame = FRAME if north is None else replace(FRAME, georeference=replace(PLACE, north=north))
    found = collect_facts(made(frame=frame), SCENE)
    counts = np.full(found.cover.counts.shape, 8)
    y = found.cover.south + (np.arange(counts.shape[0]) + 0.5) * found.cover.cell
    x = found.cover.west + (np.arange(counts.shape[1]) + 0.5) * found.cover.cell
    counts[np.ix_(y > 0.2, x < -0.2)] = 3
    spots = list_weak_spots(replace(found, cover=replace(found.cover, counts=counts)))
    said = [spot for spot in spots if "exemplar" in spot]
    assert said == [
        f"The {part} of the exemplar is mostly seen by 3 photos only. More photos of it make it sharper and surer."
    ]


def test_an_uncertain_focal_length_is_a_weak_spot(made):
    """EXIF's is held, but the photos alone would say 1.1 times that; or no EXIF, and all look straight down."""
    held = FocalLength(300.0, 300.0, 330.0, 3.0, "EXIF's")
    none = FocalLength(None, 300.0, None, 3.0, "found by the photos alone")
    for lens, said in ((held, "1.10 times that of EXIF"), (none, "focal length is unsure")):
        found = collect_facts(made(frame=replace(FRAME, focal=lens)), SCENE)
        assert any(said in spot for spot in list_weak_spots(found))


def test_coverage_does_not_depend_on_the_unit(made, flown):
    """A world in metres, 40 of them a flying height: the same photos see the same places."""
    metres = transform_model(flown, 40.0, np.eye(3), np.zeros(3))
    frame = replace(FRAME, unit="metre", flying_height=40.0, exemplar=Square(-20.0, -20.0, 40.0))
    one, two = collect_facts(made(), SCENE), collect_facts(made("metres", frame, metres), SCENE)
    assert np.array_equal(one.cover.counts, two.cover.counts)
    assert two.cover.cell == pytest.approx(40 * one.cover.cell)
    assert (one.length(0.5), two.length(20.0), two.length(3.0)) == ("0.50 flying heights", "20 m", "3.0 m")


def test_a_footprint_by_hand():
    """From height 2 a picture of 320 x 240 at focal length 300 covers 640 / 300 by 480 / 300."""
    outline = camera_footprint(synth.camera((1, 0, 2)), 9.0)
    assert np.ptp(outline, axis=0) == pytest.approx([640 / 300, 480 / 300])
    assert (outline.max(0) + outline.min(0)) / 2 == pytest.approx([1, 0])


def test_a_footprint_over_the_horizon_ends_in_reach():
    outline = camera_footprint(synth.camera((0, 0, 1), (1, 0, 1)), 3.0)
    assert np.linalg.norm(outline, axis=1).max() <= 3.0 + 1e-9 and np.isfinite(outline).all()


@pytest.mark.parametrize("most, need", [(0, 3), (2, 3), (3, 3), (12, 3), (44, 2), (200, 3), (1, 1)])
def test_every_number_of_photos_has_one_colour(made, most, need):
    found = collect_facts(made(), SCENE)
    found = replace(found, need=need, cover=replace(found.cover, counts=np.full((4, 4), most)))
    numbers = [n for low, high, _ in bin_coverage(found) for n in range(low, high + 1)]
    assert numbers == list(range(1, max(most, need) + 1))
    assert len({colour for *_, colour in bin_coverage(found)}) == len(bin_coverage(found)) <= 11


def test_masks_and_the_place_on_earth_are_listed(page, made, flown):
    cover = np.ones((synth.HEIGHT, synth.WIDTH), np.float32)
    cover[:60] = 0
    frame = replace(FRAME, georeference=PLACE)
    words = " ".join(Seen(page(made(frame=frame, covers={"003.png": cover}))).words)
    assert "25 % masked" in words and "-33.500000, 151.250000" in words and "30 degrees from north" in words


def test_photos_that_only_test_are_marked_and_do_not_count(page, made, flown):
    own = flown.image_of < 8
    sparse = replace(flown, **{k: getattr(flown, k)[own] for k in ("point_of", "image_of", "pixels")})
    frame = replace(FRAME, kind="synthetic", test=flown.names[8:], left_out=(), focal_ratio=None)
    photos = made(sparse=sparse, frame=frame)
    found = collect_facts(photos, SCENE)
    assert found.cover.counts.max() <= 8 and len(found.placed) == 8
    assert not any(photo.weak for photo in found.photos if photo.tests)
    text = page(photos)
    assert text.count("only tests") >= 8 and "8 photos were rendered, and 4 that only test" in text


def test_a_model_of_another_program_and_old_frames_are_read(page, made):
    """Neither says how the focal length was settled; an older ground.json has no word of it at all."""
    given = replace(FRAME, focal=None, focal_ratio=None)
    assert "from the model of another program" in page(made(frame=given))
    assert "1.000 times" in page(made(frame=replace(FRAME, focal=None)))


def test_a_template_that_asks_for_what_is_not_there_is_refused(made, template, tmp_path):
    wrong = tmp_path / "wrong.html"
    wrong.write_text(template.read_text() + "{{ nothing }}")
    with pytest.raises(InputError, match="wrong.html: not a template of this page .*nothing"):
        write_report(made(), wrong, SCENE, tmp_path / "report.html", segment)
    assert not (tmp_path / "report.html").exists()


def test_the_template_uses_all_that_the_report_has(made, template):
    found = collect_facts(made(), SCENE)
    smalls = make_thumbnails(made() / "images", [photo.name for photo in found.photos])
    used = meta.find_undeclared_variables(Environment().parse(template.read_text()))
    assert used == set(report.make_template_values(found, smalls, None))


@pytest.mark.parametrize(
    ("shares", "said"),
    [((0.6, 0.3, 0.1), "mixed: it has 3 kinds that look unlike (60 %, 30 %, 10 %"), ((0.98,), "one material")],
)
def test_kinds_of_ground_are_told(shares, said):
    assert said in report.describe_kinds(GroundKinds(shares, np.zeros((2, 2, 3))))


def test_the_report_says_that_ground_is_mixed(page, made):
    assert "The ground is mixed: it has 2 kinds" in page(made())
