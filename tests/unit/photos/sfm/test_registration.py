"""Structure from motion, end to end on small made-up photos, and what it says about photos it cannot use."""

from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SfmSign, SfmVerdict, read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import read_colmap_model, reprojection_errors
from dav_gswt.photos.photo_set import prepare_photos
from dav_gswt.photos.sfm import solution
from dav_gswt.photos.sfm.registration import Registration, SfmOptions, register_photos, undistort_image

HALF = 1.0  # of the made-up ground
FILM = synth.FOCAL / np.hypot(synth.WIDTH, synth.HEIGHT) * 43.2666  # 35 mm equivalent of the made-up camera
OPTIONS = SfmOptions(size=320, features=1024, side=320)


def flight():
    """Two flight lines of four at two heights: so the focal length can be determined."""
    cameras = synth.flight(2, 4, step=0.2, tilt=0.2)
    return [synth.camera(c.centre * [1, 1, 1.0 + 0.2 * (i % 2)], [0.6 * c.centre[0], 0.6 * c.centre[1] + 1e-3, 0])
            for i, c in enumerate(cameras)]  # fmt: skip


def as_jpeg(path, image, **attributes):
    """Write a JPEG with EXIF."""
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], 3, oiio.UINT8)
    for key, value in ({"CompressionQuality": 98} | attributes).items():
        if isinstance(value, tuple):
            spec.attribute(key, oiio.TypeDesc(f"float[{len(value)}]"), value)
        else:
            spec[key] = value
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
        picture = synth.photograph(camera, ground, HALF)
        as_jpeg(folder / f"{i:03d}.jpg", picture, **{"Exif:FocalLengthIn35mmFilm": round(FILM)})
    return folder


@pytest.fixture(scope="module")
def registered(photos):
    return register_photos(photos, OPTIONS)


def apart(found, true) -> float:
    """Greatest distance between camera positions after the best similarity (Umeyama), in flying heights."""
    a, b = (np.array([c.centre for c in cameras]) for cameras in (found, true))
    a, b = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    return float(np.linalg.norm(a @ (u @ sign @ vt).T * (s @ np.diag(sign)) / (a**2).sum() - b, axis=1).max())


def test_all_photos_find_the_places_they_were_taken_from(registered):
    assert registered.model.names == tuple(f"{i:03d}.png" for i in range(8)) and not registered.left_out
    # EXIF's 32 mm are rounded from 32.45, so cameras of different heights lie 1.4 % of that difference wrong.
    assert apart(registered.model.cameras, flight()) < 0.005
    assert registered.error < 0.7 and np.median(reprojection_errors(registered.model)) < 0.7


def test_good_photos_are_mapped_once(registered):
    assert registered.verdict.grade == "good" and registered.verdict.tried == ("incremental mapping: good",)


def test_the_focal_length_of_exif_is_held(registered):
    assert registered.focal_ratio == pytest.approx(1, abs=1e-12)
    assert registered.model.cameras[0].fx == pytest.approx(synth.FOCAL * round(FILM) / FILM, rel=1e-4)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_repeats_to_the_bit_whatever_the_threads(photos, registered, threads):
    again = register_photos(photos, replace(OPTIONS, threads=threads))
    for name in ("points", "colours", "point_of", "image_of", "pixels"):
        assert np.array_equal(getattr(again.model, name), getattr(registered.model, name)), name
    for one, two in zip(again.model.cameras, registered.model.cameras, strict=True):
        assert np.array_equal(one.rotation, two.rotation) and np.array_equal(one.translation, two.translation)


def test_the_global_mapper_finds_the_same_places(photos):
    found = register_photos(photos, replace(OPTIONS, mapper="global"))
    assert len(found.model.names) == 8 and found.positions is None
    assert apart(found.model.cameras, flight()) < 0.01
    again = register_photos(photos, replace(OPTIONS, mapper="global"))
    assert np.array_equal(found.model.points, again.model.points)


def test_each_photo_can_have_a_camera_of_its_own(photos):
    found = register_photos(photos, replace(OPTIONS, cameras="each"))
    assert len({tuple(lens.params) for lens in found.lenses}) == 8
    assert apart(found.model.cameras, flight()) < 0.02


def test_a_given_focal_length_takes_the_place_of_exifs(photos):
    found = register_photos(photos, replace(OPTIONS, focal=1.02 * FILM))
    assert found.focal.exif == pytest.approx(1.02 * synth.FOCAL, rel=1e-6)


def test_oblique_views_fix_a_focal_length_that_exif_has_wrong(tmp_path, ground):
    """Photos from the side: EXIF is 8 % long, the photos know better. From above it would have been held."""
    cameras = [
        synth.camera((0.75 * np.cos(a), 0.75 * np.sin(a), 0.8 + 0.1 * (i % 2)), (0.02 * i, 0, 0))
        for i, a in enumerate(np.linspace(-0.6, 0.6, 9))
    ]
    for i, camera in enumerate(cameras):
        film = {"Exif:FocalLengthIn35mmFilm": round(1.08 * FILM)}
        as_jpeg(tmp_path / f"{i:03d}.jpg", synth.photograph(camera, ground, HALF), **film)
    found = register_photos(tmp_path, OPTIONS)
    assert "from the side" in found.focal.decision
    assert found.focal.used == pytest.approx(synth.FOCAL, rel=0.02)
    assert found.focal_ratio == pytest.approx(found.focal.used / found.focal.exif)


def test_positions_by_gps_give_metres_and_north(tmp_path, ground):
    """The flight, forty metres high and turned by 30 degrees, with receivers a decimetre off."""
    rng, turn = np.random.default_rng(8), np.radians(30.0)
    true = np.array([c.centre for c in flight()]) * 40 * 4
    east, north = (
        np.cos(turn) * true[:, 0] - np.sin(turn) * true[:, 1],
        np.sin(turn) * true[:, 0] + np.cos(turn) * true[:, 1],
    )
    at = np.stack([east, north, true[:, 2]], 1) + rng.normal(0, 0.1, true.shape)
    world = Georeference(46.8, -92.0, 180.0, 0.0, 1.0)
    for i, (camera, place) in enumerate(zip(flight(), world.to_earth(at), strict=True)):
        as_jpeg(tmp_path / f"{i:03d}.jpg", synth.photograph(camera, ground, HALF), **gps_tags(place))
    made = prepare_photos(tmp_path, tmp_path / "out", OPTIONS)
    assert made.unit == "metre" and made.flying_height == pytest.approx(np.median(true[:, 2]), rel=0.02)
    reference = made.georeference
    stored = read_colmap_model(tmp_path / "out" / "sparse")
    back = world.to_world(reference.to_earth(np.array([c.centre for c in stored.cameras])))
    assert np.abs(back - at).max() < 1.0  # of flights of 100 metres: features are read to half a pixel, 0.2 m here
    assert (tmp_path / "out" / "lenses.json").exists()


def test_positions_that_contradict_the_photos_are_not_used(tmp_path, ground, caplog):
    world = Georeference(46.8, -92.0, 180.0, 0.0, 1.0)
    at = np.random.default_rng(5).normal(0, 60, (8, 3))
    for i, (camera, place) in enumerate(zip(flight(), world.to_earth(at), strict=True)):
        as_jpeg(tmp_path / f"{i:03d}.jpg", synth.photograph(camera, ground, HALF), **gps_tags(place))
    found = register_photos(tmp_path, OPTIONS)
    assert found.positions is None and "GPS" in caplog.text
    assert found.verdict.grade == "doubtful" and [sign.name for sign in found.verdict.objections] == ["GPS"]
    assert [text.split(":")[0] for text in found.verdict.tried] == [
        "incremental mapping",
        "incremental mapping, GPS as priors, EXIF's focal length held",
        "global mapping, EXIF's focal length held",
    ]
    assert apart(found.model.cameras, flight()) < 0.01


def verdict(grade: str, *names: str) -> SfmVerdict:
    return SfmVerdict(grade, tuple(SfmSign(name, grade, f"{name} is odd") for name in names))


def test_a_refused_model_stops_before_anything_is_written_unless_it_may_go_on(photos, tmp_path, monkeypatch):
    monkeypatch.setattr(solution, "judge_model", lambda *_: verdict("refused", "placed"))  # maps once
    with pytest.raises(InputError, match="do not fit together to one scene: placed is odd"):
        prepare_photos(photos, tmp_path / "out", OPTIONS)
    assert not (tmp_path / "out").exists()
    made = prepare_photos(photos, tmp_path / "out", replace(OPTIONS, verdict="warn"))
    assert read_scene_frame(tmp_path / "out" / "ground.json").verdict == made.verdict
    assert made.verdict.grade == "refused"


def test_photos_of_two_places_are_named_as_two_groups(tmp_path, ground, caplog):
    synth.shoot(tmp_path / "a", flight(), ground, HALF)
    synth.shoot(tmp_path / "b", flight()[:4], synth.texture(np.random.default_rng(9)), HALF)
    (tmp_path / "photos").mkdir()
    for path in tmp_path.glob("?/*.png"):
        path.rename(tmp_path / "photos" / f"{path.parent.name}{path.name}")
    found = register_photos(tmp_path / "photos", OPTIONS)
    assert found.verdict.grade == "doubtful" and len(found.left_out) == 4
    assert "your photos fall into 2 groups (a000.png ... a007.png | b000.png ... b003.png)" in caplog.text


def gps_tags(place):
    """EXIF of a latitude, longitude and altitude, and of the focal length."""
    tags = {"Exif:FocalLengthIn35mmFilm": round(FILM), "GPS:Altitude": float(place[2]), "GPS:AltitudeRef": 0}
    for name, value, signs in (("Latitude", place[0], "NS"), ("Longitude", place[1], "EW")):
        degrees, rest = divmod(abs(value) * 60, 60)
        minutes = rest % 60
        tags[f"GPS:{name}Ref"] = signs[int(value < 0)]
        tags[f"GPS:{name}"] = (float(degrees), float(int(minutes)), float((minutes % 1) * 60))
    return tags


def test_without_exif_the_focal_length_is_found(tmp_path, ground):
    synth.shoot(tmp_path, flight(), ground, HALF)
    found = register_photos(tmp_path, OPTIONS)
    assert found.focal_ratio is None and len(found.model.names) == 8
    # The guess is 28 % long; heights that differ by a fifth fix it to about the noise of features, 0.1 of 30 pixels.
    assert found.model.cameras[0].fx == pytest.approx(synth.FOCAL, rel=0.02)


def test_photos_with_and_without_exif_go_together(tmp_path, ground):
    """Those with a focal length hold it, the others find theirs; lens distortion is refined for all."""
    for i, camera in enumerate(flight()):
        film = {"Exif:FocalLengthIn35mmFilm": round(FILM)} if i % 2 else {}
        as_jpeg(tmp_path / f"{i:03d}.jpg", synth.photograph(camera, ground, HALF), **film)
    one, two = register_photos(tmp_path, OPTIONS), register_photos(tmp_path, OPTIONS)
    assert one.focal_ratio == pytest.approx(1, abs=0.02) and len(one.model.names) == 8
    assert [c.fx for c in one.model.cameras] == pytest.approx([synth.FOCAL] * 8, rel=0.02)
    assert all(lens.params[3] != 0 for lens in one.lenses)
    assert np.array_equal(one.model.points, two.model.points)


def test_photos_of_two_sizes_get_a_camera_each(tmp_path, ground):
    for i, camera in enumerate(flight()):
        if i % 2:
            camera = camera.resized(240, 180)
        film = {"Exif:FocalLengthIn35mmFilm": round(FILM)}
        as_jpeg(tmp_path / f"{i:03d}.jpg", synth.photograph(camera, ground, HALF), **film)
    found = register_photos(tmp_path, OPTIONS)
    assert len(found.model.names) == 8
    assert all(abs(c.width - (240 if i % 2 else 320)) <= 4 for i, c in enumerate(found.model.cameras))
    assert apart(found.model.cameras, flight()) < 0.03


def test_photos_of_two_sizes_and_one_focal_length_keep_their_own_resolution(tmp_path, ground):
    """Features are looked for at one size, at which both kinds of photos are equal."""
    for i, camera in enumerate(flight()):
        if i % 2:
            camera = camera.resized(160, 120)
        as_jpeg(tmp_path / f"{i:03d}.jpg", synth.photograph(camera, ground, HALF))
    found = register_photos(tmp_path, replace(OPTIONS, size=160))
    assert [lens.width for lens in found.lenses] == [160 if int(name[:3]) % 2 else 320 for name in found.model.names]
    assert len(found.model.names) >= 6


def test_a_photo_of_something_else_is_left_out_with_the_reason(photos, tmp_path):
    for path in photos.iterdir():
        (tmp_path / path.name).symlink_to(path)
    other = synth.texture(np.random.default_rng(77))
    as_jpeg(tmp_path / "other.jpg", synth.photograph(synth.camera((0, 0, 1)), other, HALF))
    found = register_photos(tmp_path, OPTIONS)
    assert [name for name, _ in found.left_out] == ["other.jpg"] and "matches no photo" in found.left_out[0][1]
    assert "other.png" not in found.model.names


@pytest.mark.parametrize("k", [-0.1, 0.05])
def test_an_undistorted_picture_is_what_a_pinhole_camera_sees(tmp_path, k):
    """A smooth scene photographed through a lens with distortion, against the same scene through the pinhole."""
    lens = pycolmap.Camera(model="SIMPLE_RADIAL", width=200, height=150, params=[180, 100, 75, k])
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
    seen = undistort_image(Registration(one, (tmp_path / "a.png",), (lens,), (), None, 0.0), 0)
    x, y = np.meshgrid(np.arange(flat.width) + 0.5, np.arange(flat.height) + 0.5)
    # 8 bits round by 1 / 510; cubic splines on waves of 100 pixels add less.
    assert seen == pytest.approx(scene((x - flat.cx) / flat.fx, (y - flat.cy) / flat.fy), abs=0.004)


def test_observations_lie_where_the_pictures_show_their_points(registered, photos):
    """A point's pixels in two pictures show the same colour: model and undistorted pictures belong together."""
    pictures = [undistort_image(registered, i) for i in range(8)]
    part = registered.model
    column, row = part.pixels.astype(int).T
    colour = np.array([pictures[i][r, c] for i, r, c in zip(part.image_of, row, column, strict=True)])
    mean = np.array([np.bincount(part.point_of, colour[:, c]) / np.bincount(part.point_of) for c in range(3)]).T
    spread = np.abs(colour - mean[part.point_of]).mean()
    assert spread < 0.5 * np.abs(colour - colour[np.random.default_rng(0).permutation(len(colour))]).mean()


def test_photos_may_have_any_name(photos, registered, tmp_path):
    """COLMAP's own lists end a name at a blank and skip lines that begin with #."""
    for i, path in enumerate(sorted(photos.iterdir())):
        (tmp_path / f"# photo {i} (1).jpg").symlink_to(path)
    found = register_photos(tmp_path, OPTIONS)
    assert found.model.names == tuple(f"_photo_{i}_(1).png" for i in range(8))
    assert np.array_equal(found.model.points, registered.model.points)


def test_two_photos_are_refused_by_name(tmp_path, ground):
    synth.shoot(tmp_path, flight()[:2], ground, HALF)
    with pytest.raises(InputError, match="000.png and 001.png.*at least 3"):
        register_photos(tmp_path, OPTIONS)


def test_photos_that_do_not_overlap_are_refused_with_how_many_were_placed(tmp_path):
    for i in range(4):
        texture = synth.texture(np.random.default_rng(100 + i))
        image_files.write_png(tmp_path / f"{i}.png", synth.photograph(synth.camera((0, 0, 1)), texture, HALF))
    with pytest.raises(InputError, match="0 of 4 photos.*overlap"):
        register_photos(tmp_path, OPTIONS)


def test_photos_without_texture_are_refused(tmp_path):
    for i in range(4):
        image_files.write_png(tmp_path / f"{i}.png", np.full((60, 80, 3), 0.5))
    with pytest.raises(InputError, match="0 of 4 photos.*texture"):
        register_photos(tmp_path, OPTIONS)


def test_a_half_written_photo_is_refused_by_name_and_nothing_is_left(photos, tmp_path):
    for path in photos.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "004.jpg").write_bytes((tmp_path / "004.jpg").read_bytes()[:9000])
    with pytest.raises(InputError, match="004.jpg"):
        prepare_photos(tmp_path, tmp_path / "out", OPTIONS)
    assert not [p for p in tmp_path.iterdir() if p.suffix != ".jpg"]


def test_the_photos_folder_is_whole(photos, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "old").touch()
    facts = prepare_photos(photos, tmp_path / "out", OPTIONS)
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["ground.json", "images", "lenses.json", "sparse"]
    assert read_scene_frame(tmp_path / "out" / "ground.json") == facts
    stored = read_colmap_model(tmp_path / "out" / "sparse")
    assert (facts.images, facts.registered, facts.points) == (8, 8, len(stored.points))
    for name, camera in zip(stored.names, stored.cameras, strict=True):
        assert image_files.read_size(tmp_path / "out" / "images" / name) == (camera.width, camera.height)
    assert np.median([c.centre[2] for c in stored.cameras]) == pytest.approx(1, abs=1e-9)
