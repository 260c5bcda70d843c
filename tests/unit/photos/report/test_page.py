"""The report on a scene's photos: what it says, what it warns of, what it draws, and that it needs nothing else."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import FocalLength, LeftOutPhoto, SfmSign, SfmVerdict, Square
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import transform_model
from dav_gswt.photos.folder import write_photo_folder
from dav_gswt.photos.report import figures
from dav_gswt.photos.report import page as report
from dav_gswt.photos.report.facts import PhotoFacts, collect_facts, find_weaknesses, list_weak_spots
from dav_gswt.photos.report.figures import MapSheet, Thumbnail, bin_coverage, camera_footprint, draw_plan, make_sheet
from dav_gswt.photos.report.mosaic import GroundKinds
from dav_gswt.photos.report.page import write_report
from dav_gswt.templates import render_template

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

    def make(frame=FRAME, sparse=flown, covers=None):
        folder = tmp_path_factory.mktemp("made") / "photos"
        write_photo_folder(folder, sparse, ((name, GREY) for name in sparse.names), frame, None, covers)
        return folder

    return make


@pytest.fixture(scope="module")
def facts(made):
    return collect_facts(made(), SCENE)


@pytest.fixture(scope="module")
def template(root):
    return root / "workflow" / "report" / "photos.html"


@pytest.fixture(scope="module")
def page(template, tmp_path_factory):
    """Writes a report and returns its text."""

    def write(photos):
        out = tmp_path_factory.mktemp("page") / "report.html"
        write_report(photos, template, SCENE, out, segment)
        return out.read_text()

    return write


@pytest.fixture(scope="module")
def text(page, made):
    return page(made())


@pytest.fixture
def render(template):
    """The words of the page of some facts."""

    def write(found, masked=0.0):
        thumbnails = [Thumbnail(GREY, "data:image/png;base64,", masked)] * len(found.photos)
        return " ".join(Seen(render_template(template, report.make_template_values(found, thumbnails, None))).words)

    return write


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


def test_weak_spots_stand_at_the_top_in_words(text):
    words = " ".join(Seen(text).words)
    top = words[: words.index("Where the photos were taken")]
    assert "12 of 14 photos found their place" in top
    assert "2 of 14 photos were left out" in top
    assert "2 photos are weakly placed: 004.png, 011.png" in top
    assert "held by 25 points only" in words and "3.0 px off" in words
    assert "The ground is mixed: it has 2 kinds" in words
    assert "one material" in report.describe_kinds(GroundKinds((0.98,), np.zeros((2, 2, 3))))


def test_a_set_without_weak_spots_says_so(facts, render):
    photos = tuple(replace(photo, weak=()) for photo in facts.photos)
    cover = replace(facts.cover, counts=np.full_like(facts.cover.counts, 8))
    sound = replace(facts, photos=photos, cover=cover, frame=replace(FRAME, left_out=()))
    assert list_weak_spots(sound) == [] and "Nothing is weak" in render(sound)


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


@pytest.mark.parametrize(
    "north, part",
    [(None, "upper left part (as on the map)"), (0.0, "north-west part"), (90.0, "north-east part")],
)
def test_a_corner_that_few_photos_see_is_named_by_the_compass_or_the_map(facts, north, part):
    """Of twelve photos only three see the corner in the north-west of the sheet."""
    counts = np.full(facts.cover.counts.shape, 8)
    y = facts.cover.south + (np.arange(counts.shape[0]) + 0.5) * facts.cover.cell
    x = facts.cover.west + (np.arange(counts.shape[1]) + 0.5) * facts.cover.cell
    counts[np.ix_(y > 0.2, x < -0.2)] = 3
    place = None if north is None else replace(PLACE, north=north)
    spots = list_weak_spots(replace(facts, cover=replace(facts.cover, counts=counts), place=place))
    assert [spot for spot in spots if "exemplar" in spot] == [
        f"The {part} of the exemplar is mostly seen by 3 photos only. More photos of it make it sharper and surer."
    ]


def test_other_weak_spots_of_a_set_are_told(facts):
    """EXIF's focal length is held, but the photos alone would say 1.1 times that; or none, and all look down."""
    held = FocalLength(300.0, 300.0, 330.0, 3.0, "EXIF's")
    none = FocalLength(None, 300.0, None, 3.0, "found by the photos alone")
    signs = SfmSign("tilt", "good", "5 degrees off"), SfmSign("GPS", "doubtful", "62 m off")
    for changed, said in (
        ({"verdict": SfmVerdict("doubtful", signs)}, "The cameras are doubtful: 62 m off."),
        ({"focal": held}, "1.10 times that of EXIF"),
        ({"focal": none}, "focal length is unsure"),
        ({"reprojection_error": 1.2}, "1.2 px off"),
        ({"exemplar": Square(-0.2, -0.2, 0.4)}, "only 0.40 flying heights wide"),
    ):
        assert any(said in spot for spot in list_weak_spots(replace(facts, frame=replace(FRAME, **changed)))), said
    assert not any("flying heights wide" in spot or "px off" in spot for spot in list_weak_spots(facts))


def test_coverage_does_not_depend_on_the_unit(facts, made, flown):
    """A world in metres, 40 of them a flying height: the same photos see the same places."""
    metres = transform_model(flown, 40.0, np.eye(3), np.zeros(3))
    frame = replace(FRAME, unit="metre", flying_height=40.0, exemplar=Square(-20.0, -20.0, 40.0))
    two = collect_facts(made(frame, metres), SCENE)
    assert np.array_equal(facts.cover.counts, two.cover.counts)
    assert two.cover.cell == pytest.approx(40 * facts.cover.cell)
    assert two.cover.west == pytest.approx(40 * facts.cover.west)
    assert (facts.length(0.5), two.length(20.0), two.range(3.0, 30.0)) == ("0.50 flying heights", "20 m", "3.0 to 30 m")


def test_a_footprint_by_hand():
    """From height 2 a picture of 320 x 240 at focal length 300 covers 640 / 300 by 480 / 300."""
    outline = camera_footprint(synth.camera((1, 0, 2)), 9.0)
    assert np.ptp(outline, axis=0) == pytest.approx([640 / 300, 480 / 300])
    assert (outline.max(0) + outline.min(0)) / 2 == pytest.approx([1, 0])
    outline = camera_footprint(synth.camera((0, 0, 1), (1, 0, 1)), 3.0)  # over the horizon it ends in reach
    assert np.linalg.norm(outline, axis=1).max() <= 3.0 + 1e-9 and np.isfinite(outline).all()


def test_the_plan_has_cameras_arrows_and_a_scale_where_they_belong(facts):
    """The first camera looks to the east at 45 degrees: its arrow is half a flying height long."""
    camera = synth.camera((-0.25, 0.5, 1.0), (0.75, 0.5, 0.0))
    model = replace(facts.model, cameras=(camera, *facts.model.cameras[1:]))
    found = replace(facts, model=model, photos=(replace(facts.photos[0], tilt=45.0), *facts.photos[1:]), place=PLACE)
    on = make_sheet(found)
    scale = 1000 / 2.16  # the extent of 2 and margins of 4 %
    assert (on.west, on.north, on.per_unit) == pytest.approx((-1.08, 1.08, scale))
    drawn = draw_plan(found, [Thumbnail(GREY, "", 0.0)] * 12)
    dots = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', drawn)
    expected = [((c.centre[0] + 1.08) * scale, (1.08 - c.centre[1]) * scale) for c in model.cameras]
    assert np.array(dots, float) == pytest.approx(np.array(expected), abs=0.06)
    assert re.findall(r"rotate\(0\.0\)\"><path class=\"line\" d=\"M0,0 L([\d.]+)", drawn) == [f"{0.5 * scale - 12:.1f}"]
    assert "0.25 flying heights</text>" in drawn and f"H{24 + 0.25 * scale:.1f}" in drawn and "rotate(-30.0)" in drawn
    assert f'class="exemplar" x="{0.58 * scale:.1f}" y="{0.58 * scale:.1f}" width="{scale:.1f}"' in drawn


def test_points_are_drawn_in_the_mean_colour_of_their_photos(facts):
    model = facts.model
    smalls = [Thumbnail(np.full((3, 4, 3), i / 12, np.float32), "", 0.0) for i in range(12)]
    colours = figures.average_colours(model, smalls)
    assert colours[:, 0] == pytest.approx(np.bincount(model.point_of, model.image_of / 12, 3000)
                                          / np.maximum(np.bincount(model.point_of, minlength=3000), 1))  # fmt: skip
    two = replace(model, points=np.array([[1.0, 1.5, 0.2], [1.0, 1.5, 0.1]]), colours=model.colours[:2])
    drawn = figures.draw_points(two, np.eye(3, dtype=np.float32)[:2], MapSheet(0.0, 2.0, 1000.0, 500.0, 250.0))
    assert drawn.shape == (300, 600, 4)
    rows, columns = np.nonzero(drawn[..., 3])
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (73, 77, 148, 152)
    assert (drawn[75, 150] == [255, 0, 0, 255]).all()  # the higher over the lower


@pytest.mark.parametrize("most, need", [(0, 3), (3, 3), (12, 3), (44, 2), (1, 1)])
def test_every_number_of_photos_has_one_colour(facts, most, need):
    found = replace(facts, need=need, cover=replace(facts.cover, counts=np.full((4, 4), most)))
    numbers = [n for low, high, _ in bin_coverage(found) for n in range(low, high + 1)]
    assert numbers == list(range(1, max(most, need) + 1))
    assert len({colour for *_, colour in bin_coverage(found)}) == len(bin_coverage(found)) <= 11


def test_masks_and_the_place_on_earth_are_listed(facts, render, tmp_path):
    cover = np.ones((12, 16), np.float32)
    cover[:3] = 0
    image_files.write_png(tmp_path / "a.png", np.dstack([GREY, cover]))
    masked = figures.make_thumbnail(tmp_path / "a.png", 8).masked
    words = render(replace(facts, place=PLACE), masked)
    assert "25 % masked" in words and "-33.500000, 151.250000" in words and "30 degrees from north" in words


def test_photos_that_only_test_are_marked_and_do_not_count(made, flown, render):
    own = flown.image_of < 8
    sparse = replace(flown, **{k: getattr(flown, k)[own] for k in ("point_of", "image_of", "pixels")})
    frame = replace(FRAME, kind="synthetic", test=flown.names[8:], left_out=(), focal_ratio=None)
    found = collect_facts(made(frame, sparse), SCENE)
    assert found.cover.counts.max() <= 8 and len(found.placed) == 8
    assert not any(photo.weak for photo in found.photos if photo.tests)
    words = render(found)
    assert words.count("only tests") >= 4 and "8 photos were rendered, and 4 that only test" in words


def test_a_model_of_another_program_and_old_frames_are_read(facts):
    """Neither says how the focal length was settled; an older ground.json has no word of it at all."""
    given = replace(facts, frame=replace(FRAME, focal=None, focal_ratio=None))
    assert report.describe_focal_length(given) == ("as given", "from the model of another program")
    assert report.describe_focal_length(replace(facts, frame=replace(FRAME, focal=None)))[0] == "1.000 times EXIF's"


def test_a_template_that_asks_for_what_is_not_there_is_refused(made, template, tmp_path):
    wrong = tmp_path / "wrong.html"
    wrong.write_text(template.read_text() + "{{ nothing }}")
    with pytest.raises(InputError, match="wrong.html: not a template of this page .*nothing"):
        write_report(made(), wrong, SCENE, tmp_path / "report.html", segment)
    assert not (tmp_path / "report.html").exists()
