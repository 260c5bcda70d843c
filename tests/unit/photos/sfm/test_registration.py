"""Structure from motion on small made-up photos, and what it says about photos it cannot use."""

import shutil
from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
from fixtures import photos as synth
from fixtures import rooms

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import read_colmap_model, reprojection_errors
from dav_gswt.photos.photo_set import prepare_photos
from dav_gswt.photos.sfm import gps, mapping, registration
from dav_gswt.photos.sfm.mapping import Approach
from dav_gswt.photos.sfm.registration import Registration, SfmOptions, register_photos, undistort_pixels

HALF = 1.0  # of the made-up ground
FILM = synth.FOCAL / np.hypot(synth.WIDTH, synth.HEIGHT) * 43.2666  # 35 mm equivalent of the made-up camera
OPTIONS = SfmOptions(size=320, features=512, side=320)
NAMES = tuple(f"{i:03d}.png" for i in range(8))


def flight():
    """Two flight lines of four at two heights: so the focal length can be determined."""
    cameras = synth.flight(2, 4, step=0.2, tilt=0.2)
    return [synth.camera(c.centre * [1, 1, 1.0 + 0.2 * (i % 2)], [0.6 * c.centre[0], 0.6 * c.centre[1] + 1e-3, 0])
            for i, c in enumerate(cameras)]  # fmt: skip


def as_jpeg(path, camera, ground, exif=True):
    """Write what a camera sees as a JPEG, with the focal length in its EXIF."""
    image = synth.photograph(camera, ground, HALF)
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], 3, oiio.UINT8)
    spec["CompressionQuality"] = 98
    if exif:
        spec["Exif:FocalLengthIn35mmFilm"] = round(FILM)
        spec["Exif:DateTimeOriginal"] = "2016:06:23 16:33:00"
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(np.rint(image * 255).astype(np.uint8))
    file.close()


@pytest.fixture(scope="module")
def ground():
    return synth.texture(np.random.default_rng(4))


@pytest.fixture(scope="module")
def photos(tmp_path_factory, ground):
    """Eight photos with EXIF."""
    folder = tmp_path_factory.mktemp("photos")
    for i, camera in enumerate(flight()):
        as_jpeg(folder / f"{i:03d}.jpg", camera, ground)
    return folder


@pytest.fixture(scope="module")
def solved(photos):
    """The photos registered, and the solution that the registration is made of."""
    solutions = []

    def find(*arguments):
        solutions.append(find_solution(*arguments))
        return solutions[0]

    with pytest.MonkeyPatch.context() as patch:
        find_solution = registration.find_solution
        patch.setattr(registration, "find_solution", find)
        return register_photos(photos, OPTIONS), solutions[0]


@pytest.fixture(scope="module")
def registered(solved):
    return solved[0]


def apart(found, true) -> float:
    """Greatest distance between camera positions after the best similarity (Umeyama), in flying heights."""
    a, b = (np.array([c.centre for c in cameras]) for cameras in (found, true))
    a, b = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    return float(np.linalg.norm(a @ (u @ sign @ vt).T * (s @ np.diag(sign)) / (a**2).sum() - b, axis=1).max())


def test_all_photos_find_the_places_they_were_taken_from(registered, photos):
    assert registered.model.names == NAMES and not registered.left_out
    assert [path.name for path in registered.sources] == [f"{i:03d}.jpg" for i in range(8)]
    # EXIF's 32 mm are rounded from 32.45, so cameras of different heights lie 1.4 % of that difference wrong.
    assert apart(registered.model.cameras, flight()) < 0.005
    assert registered.error < 0.7 and np.median(reprojection_errors(registered.model)) < 0.7
    assert registered.verdict.grade == "good" and registered.verdict.tried == ("incremental mapping: good",)
    assert registered.focal.ratio == pytest.approx(1, abs=1e-12)
    assert registered.model.cameras[0].fx == pytest.approx(synth.FOCAL * round(FILM) / FILM, rel=1e-4)


def test_copies_count_once_and_damaged_photos_are_left_out_by_name(photos, tmp_path, caplog, monkeypatch):
    """Also of photos in a subfolder; the good ones then go the way that they go without the others."""
    given = []
    monkeypatch.setattr(registration, "find_solution", lambda scene, seed: given.extend(scene.photos) or 1 / 0)
    for path in photos.iterdir():
        folder = tmp_path / ("day2" if path.stem > "003" else ".")
        folder.mkdir(exist_ok=True)
        shutil.copy(path, folder)
        shutil.copy(path, tmp_path / f"{path.stem} (1).jpg")
    (tmp_path / "text.jpg").write_text("no photo")
    whole = (photos / "000.jpg").read_bytes()
    (tmp_path / "cut.jpg").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ZeroDivisionError):
        register_photos(tmp_path, replace(OPTIONS, features=64))
    assert tuple(sorted(photo.key for photo in given)) == NAMES
    assert "copies among the 18 photos: 8 (000 (1).jpg of 000.jpg)" in caplog.text
    assert "left out: " in caplog.text and "text.jpg: not readable" in caplog.text and "cut.jpg: damaged" in caplog.text


@pytest.mark.slow
def test_a_run_repeats_to_the_bit_whatever_the_threads(photos, registered):
    again = register_photos(photos, replace(OPTIONS, threads=2))
    for name in ("points", "colours", "point_of", "image_of", "pixels"):
        assert np.array_equal(getattr(again.model, name), getattr(registered.model, name)), name
    for one, two in zip(again.model.cameras, registered.model.cameras, strict=True):
        assert np.array_equal(one.rotation, two.rotation) and np.array_equal(one.translation, two.translation)


WORLD = Georeference(46.8, -92.0, 180.0, 0.0, 1.0)


def fly_in_metres():
    """Positions by GPS: the flight, 160 metres high and turned by 30 degrees, with receivers a decimetre off."""
    c, s = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    true = np.array([camera.centre for camera in flight()]) * 160
    return true @ [[c, s, 0], [-s, c, 0], [0, 0, 1]] + np.random.default_rng(8).normal(0, 0.1, true.shape)


@pytest.fixture
def locate(photos, monkeypatch):
    """Gives the photos positions by GPS."""

    def give(at):
        places = dict(zip(sorted(photos.iterdir()), WORLD.to_earth(at).tolist(), strict=True))
        monkeypatch.setattr(gps, "read_gps_position", lambda path: tuple(places[path]))

    return give


def test_positions_by_gps_give_metres_and_north_and_the_photos_folder_is_whole(photos, tmp_path, locate):
    at = fly_in_metres()
    locate(at)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "old").touch()
    made = prepare_photos(photos, tmp_path / "out", OPTIONS)
    assert made.unit == "metre" and made.flying_height == pytest.approx(np.median(at[:, 2]), rel=0.02)
    stored = read_colmap_model(tmp_path / "out" / "sparse")
    back = WORLD.to_world(made.georeference.to_earth(np.array([c.centre for c in stored.cameras])))
    assert np.abs(back - at).max() < 1.0  # of flights of 100 metres: features are read to half a pixel, 0.2 m here
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["ground.json", "images", "lenses.json", "sparse"]
    assert read_scene_frame(tmp_path / "out" / "ground.json") == made
    assert (made.sun.clock, made.sun.zone, round(made.sun.azimuth)) == ("assumed", -6, 270)  # in the zone of 92 W
    assert (made.images, made.registered, made.points) == (8, 8, len(stored.points))
    for name, camera in zip(stored.names, stored.cameras, strict=True):
        assert image_files.read_size(tmp_path / "out" / "images" / name) == (camera.width, camera.height)


def test_photos_with_and_without_exif_go_together(tmp_path, ground):
    """Those with a focal length hold it, the others find theirs; lens distortion is refined for all."""
    for i, camera in enumerate(flight()):
        as_jpeg(tmp_path / f"{i:03d}.jpg", camera, ground, exif=bool(i % 2))
    found = register_photos(tmp_path, replace(OPTIONS, features=1024))
    assert found.focal.ratio == pytest.approx(1, abs=0.02) and found.model.names == NAMES
    assert [c.fx for c in found.model.cameras] == pytest.approx([synth.FOCAL] * 8, rel=0.02)
    assert all(lens.params[3] != 0 for lens in found.lenses)


def test_an_undistorted_picture_is_what_a_pinhole_camera_sees(tmp_path):
    """A smooth scene photographed through a lens with distortion, against the same scene through the pinhole."""
    lens = pycolmap.Camera(model="SIMPLE_RADIAL", width=200, height=150, params=[180, 100, 75, -0.1])
    pinhole = pycolmap.undistort_camera(pycolmap.UndistortCameraOptions(blank_pixels=0), lens)

    def scene(x, y):
        return np.stack([0.5 + 0.4 * np.sin(9 * x), 0.5 + 0.4 * np.cos(7 * y), 0.5 + 0.3 * np.sin(5 * x * y)], -1)

    x, y = np.meshgrid(np.arange(200) + 0.5, np.arange(150) + 0.5)
    rays = lens.cam_from_img(np.stack([x.ravel(), y.ravel()], 1)).reshape(150, 200, 2)
    image_files.write_png(tmp_path / "a.png", scene(rays[..., 0], rays[..., 1]))
    flat = replace(
        synth.camera((0, 0, 1)),
        fx=pinhole.focal_length_x, fy=pinhole.focal_length_y, cx=pinhole.principal_point_x,
        cy=pinhole.principal_point_y, width=pinhole.width, height=pinhole.height,
    )  # fmt: skip
    one = replace(synth.model([flat], np.zeros((1, 3))), names=("a.png",))
    found = Registration(one, (tmp_path / "a.png",), (lens,), (), None, 0.0)
    seen = undistort_pixels(found, 0, image_files.read_photo(tmp_path / "a.png"))
    x, y = np.meshgrid(np.arange(flat.width) + 0.5, np.arange(flat.height) + 0.5)
    # 8 bits round by 1 / 510; cubic splines on waves of 100 pixels add less.
    assert seen == pytest.approx(scene((x - flat.cx) / flat.fx, (y - flat.cy) / flat.fy), abs=0.004)


def test_photos_that_cannot_be_used_are_refused(tmp_path):
    for i in range(2):
        image_files.write_png(tmp_path / f"{i}.png", np.full((60, 80, 3), 0.3 + 0.1 * i))
    with pytest.raises(InputError, match="0.png and 1.png.*at least 3"):
        register_photos(tmp_path, OPTIONS)
    (tmp_path / "2.jpg").write_text("no photo")
    with pytest.raises(InputError, match="2.jpg: not readable.*at least 3"):
        register_photos(tmp_path, OPTIONS)
    image_files.write_png(tmp_path / "2.png", np.full((60, 80, 3), 0.5))
    with pytest.raises(InputError, match="no two of the 3 photos show the same ground: .*texture"):
        register_photos(tmp_path, OPTIONS)


def test_a_camera_that_stands_still_is_told_to_move(tmp_path, ground):
    rng = np.random.default_rng(0)
    still = synth.photograph(synth.camera((0, 0, 1)), ground, HALF)
    for i in range(4):
        image_files.write_png(tmp_path / f"{i}.png", still + rng.normal(0, 0.01, still.shape))
    with pytest.raises(InputError, match="stood still: the 4 photos .* Walk or fly"):
        register_photos(tmp_path, OPTIONS)


@pytest.mark.slow
def test_the_global_mapper_finds_the_same_places(photos, monkeypatch):
    monkeypatch.setattr(
        registration, "find_solution", lambda scene, seed: mapping._solve(Approach("global"), scene, seed)
    )
    found, again = (register_photos(photos, OPTIONS) for _ in range(2))
    assert found.model.names == NAMES and found.positions is None
    assert apart(found.model.cameras, flight()) < 0.01
    assert np.array_equal(found.model.points, again.model.points)


@pytest.mark.slow
def test_without_exif_the_focal_length_is_found_and_a_photo_of_something_else_is_left_out(tmp_path, ground):
    synth.shoot(tmp_path, flight(), ground, HALF)
    other = synth.photograph(synth.camera((0, 0, 1)), synth.texture(np.random.default_rng(77)), HALF)
    image_files.write_png(tmp_path / "other.png", other)
    found = register_photos(tmp_path, OPTIONS)
    ((name, reason),) = found.left_out
    assert name == "other.png" and "matches no photo" in reason and found.model.names == NAMES
    # The guess is 28 % long; heights that differ by a fifth fix it to about the noise of features.
    assert found.focal.ratio is None and found.model.cameras[0].fx == pytest.approx(synth.FOCAL, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("take", [rooms.photograph_room, rooms.photograph_table])
def test_a_room_and_a_thing_on_a_table_are_no_ground(tmp_path, take):
    for i, picture in enumerate(take(np.random.default_rng(3))):
        image_files.write_png(tmp_path / f"{i:02d}.png", picture)
    with pytest.raises(InputError, match="show no ground: photos look .* Photograph an open patch of ground"):
        register_photos(tmp_path, replace(OPTIONS, features=2000))


WEAK = ("IMG_0022.jpg", "IMG_0025.jpg", "IMG_0028.jpg")  # they hang on the other seven by three to seven points
FIRM = tuple(f"IMG_{n:04d}.jpg" for n in (31, 34, 37, 43, 46, 49, 52))


@pytest.mark.slow
@pytest.mark.parametrize("mapper", ["incremental", "global"])
def test_photos_that_hang_on_the_others_by_a_few_points_are_left_out_by_name(photo_sets, tmp_path, monkeypatch, mapper):
    for name in (*WEAK, *FIRM):
        (tmp_path / name).symlink_to(photo_sets / "copr_dunes/images" / name)
    if mapper == "global":
        monkeypatch.setattr(
            registration, "find_solution", lambda scene, seed: mapping._solve(Approach("global"), scene, seed)
        )
    found = register_photos(tmp_path, SfmOptions(side=512))
    assert {name for name, _ in found.left_out} == set(WEAK) and len(found.model.names) == len(FIRM)
    assert {sign.name: sign.grade for sign in found.verdict.signs}["hangs together"] == "good"
    if mapper == "global":
        assert all("points tie it to the other photos" in reason for _, reason in found.left_out)
