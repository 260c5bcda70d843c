"""The report on a scene's photos: what it counts and advises, and that it needs nothing but itself."""

import re
from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.geometry.scene_frame import FocalLength, LeftOutPhoto, SfmSign, SfmVerdict, Square
from dav_gswt.geometry.sun import CapturedSun
from dav_gswt.photos.photo_set import write_photo_folder
from dav_gswt.photos.report import list_advice, write_report

FRAME = scene_frame(
    kind="photos",
    unit="flying height",
    flying_height=1.0,
    exemplar=(-0.5, -0.5, 1.0),
    extent=(-1.0, -1.0, 1.0, 1.0),
    relief=0.01,
    images=14,
    registered=12,
    left_out=(LeftOutPhoto("<b>bold</b>.jpg", "it matches <i>no</i> photo & nothing else"),),
    focal_ratio=1.0,
    focal=FocalLength(300.0, 300.0, 303.0, 30.0, "EXIF's, which the photos confirm"),
    reprojection_error=0.4,
    points=3000,
    sun=CapturedSun(33.5, 225.0, "2024-06-23T20:00:00Z", "assumed", -8.0, 0.1),
    verdict=SfmVerdict("doubtful", (SfmSign("tilt", "doubtful", "it is odd"), SfmSign("relief", "good", "flat"))),
)
GREY = np.full((12, 16, 3), 0.5, np.float32)


@pytest.fixture(scope="module")
def flown():
    """Twelve photos in three flight lines of four."""
    sparse = synth.model(synth.flight(3, 4), synth.plain(3000, 0.9, np.random.default_rng(1)))
    return replace(sparse, names=('<img src="x">&.png', *sparse.names[1:]))


@pytest.fixture(scope="module")
def made(flown, tmp_path_factory):
    """Writes a photos/ folder; its pictures are small."""

    def make(frame=FRAME, sparse=flown):
        folder = tmp_path_factory.mktemp("made") / "photos"
        write_photo_folder(folder, sparse, ((name, GREY) for name in sparse.names), frame)
        return folder

    return make


def test_the_page_needs_nothing_but_itself_and_escapes_names(made, root, tmp_path):
    for out in ("a.html", "b.html"):
        write_report(made(), root / "workflow" / "report" / "photos.html", 'dunes "<&>"', tmp_path / out)
    text = (tmp_path / "a.html").read_text()
    assert text == (tmp_path / "b.html").read_text(), "equal photos give equal bytes"
    links = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert len(links) == 13 and all(link.startswith("data:image/") for link in links)
    assert "default-src 'none'" in text and not re.search(r"url\(|@import|<script|https?:", text)
    assert not {"<b>", "<i>"} & set(re.findall(r"<[^>]*>", text))
    for said in (
        "matches &lt;i&gt;no&lt;/i&gt;",
        "&lt;img src=",
        "&lt;b&gt;bold",
        "12 of 14 photos",
        "it is odd",
        "the sun stood 34 degrees high in the south-west, from the photos&#39; EXIF time; assumed zone UTC-8",
        "0.40 px on average (good: up to 0.9)",
    ):
        assert said in text


def test_advice_names_what_is_weak():
    said = " ".join(list_advice(FRAME))
    assert "camera poses are doubtful, since it is odd" in said and "1 of 14 photos were left out" in said
    small = replace(FRAME, exemplar=Square(0.0, 0.0, 0.4))
    assert "0.40 camera heights wide" in list_advice(small)[-1]


def test_the_page_says_which_ground_the_photos_miss(flown, root, tmp_path):
    """Of twelve photos all but those at the corners are blurred: only one photo shows the ground below each."""
    sharp = np.random.default_rng(0).random((60, 80, 3), np.float32)
    for blurred in ((), (1, 2, 4, 5, 6, 7, 9, 10)):
        pictures = ((name, GREY if i in blurred else sharp) for i, name in enumerate(flown.names))
        write_photo_folder(tmp_path / "photos", flown, pictures, FRAME)
        write_report(tmp_path / "photos", root / "workflow/report/photos.html", "dunes", tmp_path / "a.html")
        text = (tmp_path / "a.html").read_text()
        assert ("No gaps" in text, "Blurred: 001, 002" in text) == (not blurred, bool(blurred))
        assert ("seen by too few photos, at" in text.replace("square camera heights ", "")) == bool(blurred)
