import re
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.capture import drop_folder, handheld
from dav_gswt.capture.store import PhotoStore, Site
from dav_gswt.errors import InputError
from dav_gswt.field import write_field
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.images import image_files
from dav_gswt.raster import render

MIDDLE = [1.6, 1.6, 0.0]
FRAME = replace(made.FRAME, flying_height=1.6)
NORTH = Georeference(47.1, 8.2, 430.0, north=90.0, metres_per_unit=2.0)
ORBITS = [(40, 0, 2.0), (35, 180, 2.4), (90, 0, 1.8), (30, 90, 2.5)]


@pytest.fixture
def site(tmp_path, monkeypatch, root):
    monkeypatch.setattr(drop_folder, "import_dropped_photos", lambda site, requested, agent: requested)
    return Site(
        "moor",
        {"agent": "handheld"},
        FRAME,
        tmp_path,
        PhotoStore(tmp_path / "captures" / "moor"),
        shot_list_template=root / "workflow" / "report" / "shot_list.html",
    )


@pytest.fixture
def requested():
    found = [camera_layouts.orbit(*orbit, MIDDLE, 64, 48, 60.0) for orbit in ORBITS]
    return [(pose_of_camera(f"pose_{i}", camera, FRAME), camera) for i, camera in enumerate(found)]


@pytest.fixture
def listed(site, requested, tmp_path):
    """The page's folder and its text."""
    write_field(made.field(), tmp_path / "field.ply")
    with pytest.raises(InputError):
        handheld.take_photos(replace(site, field=tmp_path / "field.ply"), requested)
    folder = site.store.folder / "shot-list"
    return folder, (folder / "index.html").read_text()


def test_the_page_is_whole_and_asks_for_nothing_from_the_net(listed):
    folder, text = listed
    assert not re.search(r"<(script|link|iframe)\b", text) and "{" not in text.split("</style>")[1]
    links = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert len(links) >= 4 + 4 + 1  # to the places, their pictures, the map
    for link in links:
        target = link.removeprefix("#")
        assert f'id="{target}"' in text if link.startswith("#") else (folder / link).is_file()
    assert text.count('alt="Expected picture from place') == 4
    assert sorted(p.name for p in folder.iterdir()) == [
        "index.html",
        "map.png",
        *(f"place_{i:03d}.png" for i in range(1, 5)),
    ]


def test_the_expected_picture_is_what_the_field_shows_from_there(listed, requested):
    picture = image_files.read_photo(listed[0] / "place_001.png")
    assert picture.shape == (540, 720, 3)
    first = int(re.search(r"<code>pose_(\d)</code>", listed[1])[1])
    seen = render(made.field(), requested[first][1].resized(720, 540), handheld.BLANK).colour
    np.testing.assert_allclose(picture, np.clip(seen, 0, 1), atol=0.01)


def test_an_older_list_goes_and_photos_stay(site, requested, monkeypatch):
    with pytest.raises(InputError):
        handheld.take_photos(site, requested)
    folder = site.store.folder / "shot-list"
    assert sorted(p.name for p in folder.iterdir()) == ["index.html", "map.png"]  # without a field no pictures
    assert "picture expected" not in (folder / "index.html").read_text()
    photo = drop_folder.make_drop_folder(site) / "a.jpg"
    photo.write_text("photo")
    with pytest.raises(InputError) as said:
        handheld.take_photos(replace(site, name="a<b>&"), requested[:1])
    for part in ("shot-list/index.html", "photos of 1 pose are missing (pose_0)", "drop", "same command again"):
        assert part in str(said.value)
    assert photo.read_text() == "photo"
    text = (folder / "index.html").read_text()
    assert text.count("<article") == 1 and "a&lt;b&gt;&amp;" in text and "<b>&" not in text
    monkeypatch.setattr(drop_folder, "import_dropped_photos", lambda site, requested, agent: [])
    assert handheld.take_photos(site, requested) is None


def test_the_map_shows_the_exemplar_and_every_pose(site, requested):
    view = handheld.place_map_camera([camera for _, camera in requested], FRAME)
    inside = view.project(np.array([[0, 0, 0], [3.2, 3.2, 0], *(c.centre for _, c in requested)]))[0]
    assert (inside > 0).all() and (inside < [view.width, view.height]).all()
    page = handheld.write_shot_list(site, requested, None)
    assert image_files.read_size(page.with_name("map.png")) == (view.width, view.height)
    text = page.read_text()
    assert text.count('class="arrow"') == 3  # the fourth looks straight down
    bar, shown = (re.search(found, text)[1] for found in (r"v8h([\d.]+)v", r">([\d.]+) m</text>"))
    assert float(bar) == pytest.approx(float(shown) * view.fx)  # a unit of the world is a metre here
    at = re.findall(r'aria-label="Place \d"><g transform="translate\(([\d. ]+)\)', text)
    cameras_by_name = {pose.name: camera for pose, camera in requested}
    for place, name in zip(at, re.findall(r"<code>(pose_\d)</code>", text), strict=True):
        expected = view.project(cameras_by_name[name].centre[None])[0][0]
        np.testing.assert_allclose([float(v) for v in place.split()], expected)
    turns = sorted(abs(float(turn)) for turn in re.findall(r'arrow" transform="rotate\(([-\d.e]+)\)', text))
    assert turns == pytest.approx([0, 90, 180], abs=1e-6)  # to the right, along y, to the left
    assert "N</text>" not in text
    known = replace(site, frame=replace(FRAME, georeference=NORTH))
    assert "rotate(-90.0)" in handheld.write_shot_list(known, requested[:1], None).read_text()
