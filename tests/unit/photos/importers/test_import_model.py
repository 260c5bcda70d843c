"""Camera models of other programs: one made-up scene in three formats, the same cameras, pictures and points."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
from fixtures import photos as synth
from fixtures.imported_models import (
    HEIGHT,
    NUMBERS,
    OPTIONS,
    SCENE,
    WIDTH,
    WORLD,
    alike,
    lens,
    photograph,
    reconstruction,
    shoot,
    transforms,
    write_colmap,
    write_json,
)

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import read_colmap_model, reprojection_errors, triangulate_points
from dav_gswt.photos.importers import import_model, points
from dav_gswt.photos.importers.photo_matching import MatchedPhoto, PhotoFolder
from dav_gswt.photos.importers.points import find_near_pairs
from dav_gswt.photos.photo_set import prepare_photos
from dav_gswt.photos.sfm.registration import undistort_image


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    shoot(folder)
    return folder


@pytest.fixture(scope="module")
def three(photos, tmp_path_factory):
    """The scene read from each of the three formats."""
    folder = tmp_path_factory.mktemp("models")
    write_colmap(folder / "colmap")
    sources = {
        "colmap": folder / "colmap",
        "nerfstudio": write_json(folder / "transforms.json", transforms()),
        "opensfm": write_json(folder / "reconstruction.json", reconstruction()),
    }
    return {kind: import_model(path, photos, OPTIONS) for kind, path in sources.items()}


@pytest.mark.parametrize("kind", ["colmap", "nerfstudio", "opensfm"])
def test_the_cameras_are_those_of_the_scene(three, kind):
    found = three[kind]
    assert found.model.names == SCENE.names and not found.left_out
    for i, camera in enumerate(found.model.cameras):
        assert camera.rotation == pytest.approx(SCENE.rotations[i], abs=1e-9)
        assert camera.translation == pytest.approx(SCENE.translations[i], abs=1e-9)
    assert found.lenses[0].params == pytest.approx(np.array(NUMBERS), abs=1e-9)


@pytest.mark.parametrize("kind", ["nerfstudio", "opensfm"])
def test_all_formats_give_the_same_pictures_and_points(three, kind):
    one, two = three["colmap"], three[kind]
    for i in (0, 5):
        a, b = one.model.cameras[i], two.model.cameras[i]
        assert [a.fx, a.fy, a.cx, a.cy, a.width, a.height] == pytest.approx([b.fx, b.fy, b.cx, b.cy, b.width, b.height])
        assert undistort_image(one, i) == pytest.approx(undistort_image(two, i), abs=1e-5)
    n = len(one.model.points)
    assert two.model.points[:n] == pytest.approx(one.model.points, abs=1e-5)


def test_points_found_under_the_given_cameras_lie_on_the_ground(three):
    found = three["nerfstudio"]
    assert len(found.model.points) > 200
    # Features lie a fifth of a pixel of 1/300 off; over base lines of a fifth of the height that is five times as much.
    assert np.median(np.abs(found.model.points @ WORLD[:, 2])) < 0.003
    assert found.error < 0.7 and np.median(reprojection_errors(found.model)) < 0.7


def test_an_undistorted_picture_is_that_of_its_pinhole_camera(three):
    found, ground = three["opensfm"], synth.texture(np.random.default_rng(4))
    c = found.model.cameras[2]
    exact = pycolmap.Camera(model="PINHOLE", width=c.width, height=c.height, params=[c.fx, c.fy, c.cx, c.cy])
    assert alike(undistort_image(found, 2), photograph(exact, c.rotation, c.translation, ground))


def test_points_that_nobody_is_known_to_see_follow_the_others(three):
    n = len(three["colmap"].model.points)
    assert len(three["opensfm"].model.points) == n + len(SCENE.points)
    assert three["opensfm"].model.points[n:] == pytest.approx(SCENE.points, abs=1e-12)
    assert three["opensfm"].model.point_of.max() < n


@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_repeats_to_the_bit(three, photos, tmp_path, threads):
    path = write_json(tmp_path / "t.json", transforms())
    again = import_model(path, photos, replace(OPTIONS, threads=threads))
    for name in ("points", "colours", "point_of", "image_of", "pixels"):
        assert np.array_equal(getattr(again.model, name), getattr(three["nerfstudio"].model, name)), name


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
def test_observations_of_a_colmap_model_are_its_own(photos, tmp_path, binary):
    write_colmap(tmp_path / "sparse" / "0", sees=True)
    if binary:
        stored = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
        (tmp_path / "b").mkdir()
        stored.write_binary(str(tmp_path / "b"))
    found = import_model(tmp_path / "b" if binary else tmp_path, photos, OPTIONS)
    assert found.model.points == pytest.approx(SCENE.points, abs=1e-12)
    assert found.model.colours == pytest.approx(np.tile([0.2, 0.4, 0.8], (60, 1)), abs=1e-6)
    assert found.error < 1e-6 and reprojection_errors(found.model).max() < 1e-4
    assert len(found.model.pixels) > 0.7 * 60 * 8


def test_photos_may_be_smaller_than_the_models_and_pictures_smaller_still(tmp_path):
    shoot(tmp_path / "half", 0.5)
    write_colmap(tmp_path / "m", sees=True)
    found = import_model(tmp_path / "m", tmp_path / "half", replace(OPTIONS, side=100))
    assert max(found.lenses[0].width, found.lenses[0].height) == 100
    assert max(found.model.cameras[0].width, found.model.cameras[0].height) <= 100
    assert reprojection_errors(found.model).max() < 1e-4
    assert undistort_image(found, 0).shape == (found.model.cameras[0].height, found.model.cameras[0].width, 3)


def test_photos_of_another_shape_are_refused_by_name(tmp_path, photos):
    for path in photos.iterdir():
        image_files.write_png(tmp_path / "cut" / path.name, image_files.read_photo(path)[:200])
    write_colmap(tmp_path / "m", sees=True)
    with pytest.raises(InputError, match=r"000.png: the photo has 320 x 200 pixels, .* 320 x 240"):
        import_model(tmp_path / "m", tmp_path / "cut", OPTIONS)


def test_photos_and_images_without_each_other_are_left_out_with_the_reason(tmp_path):
    shoot(tmp_path / "photos")
    (tmp_path / "photos" / "001.png").unlink()
    (tmp_path / "photos" / "007.png").rename(tmp_path / "photos" / "other.png")
    (tmp_path / "photos" / "thumbs").mkdir()  # has nothing of the model: not worth telling
    image_files.write_png(tmp_path / "photos" / "thumbs" / "x.png", np.zeros((4, 4, 3)))
    write_colmap(tmp_path / "m", sees=True)
    found = import_model(tmp_path / "m", tmp_path / "photos", OPTIONS)
    assert found.model.names == tuple(n for n in SCENE.names if n not in ("001.png", "007.png"))
    reasons = dict(found.left_out)
    assert set(reasons) == {"001.png", "007.png", "other.png"}
    assert "no photo" in reasons["001.png"] and "no camera" in reasons["other.png"]
    for i, camera in enumerate(found.model.cameras):
        at = SCENE.names.index(found.model.names[i])
        assert camera.translation == pytest.approx(SCENE.translations[at], abs=1e-9)


def test_names_are_found_by_path_then_file_name_then_stem(tmp_path):
    files = ["a/1.jpg", "b/1.jpg", "b/2.png", "c/3.v2.jpg"]
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        image_files.write_png(tmp_path / name, np.zeros((4, 4, 3)))
    found = PhotoFolder(tmp_path)
    assert [found.find(n) for n in ("a/1.jpg", "b/1", "x/2.png", "2.JPG", "3.v2")] == [
        *("a/1.jpg", "b/1.jpg", "b/2.png", "b/2.png", "c/3.v2.jpg")
    ]
    assert found.find("1.jpg") is None and found.find("3") is None  # of two photos, of none


def test_photos_of_equal_names_in_two_folders_become_pictures_of_two_names(tmp_path):
    names = [f"{'ab'[i % 2]}/{i // 2}.png" for i in range(8)]
    shoot(tmp_path / "photos", names=names)
    write_colmap(tmp_path / "m", names, sees=True)
    found = import_model(tmp_path / "m", tmp_path / "photos", OPTIONS)
    assert sorted(found.model.names) == sorted(f"{n.replace('/', '_').replace('.', '_')}.png" for n in names)
    assert [s.relative_to(tmp_path / "photos").as_posix() for s in found.sources] == sorted(names)


def test_one_photo_of_two_images_is_refused(tmp_path, photos):
    values = transforms()
    values["frames"][1]["file_path"] = "elsewhere/000.jpg"
    with pytest.raises(InputError, match=r"are one photo: 000.png"):
        import_model(write_json(tmp_path / "t.json", values), photos, OPTIONS)


def test_fewer_than_three_photos_are_too_few(tmp_path):
    shoot(tmp_path / "photos", names=SCENE.names[:2])
    write_colmap(tmp_path / "m")
    with pytest.raises(InputError, match="2 of its 8 images have a photo"):
        import_model(tmp_path / "m", tmp_path / "photos", OPTIONS)


@pytest.mark.parametrize("orientation", [3, 6, 8])
def test_a_turned_photo_is_turned_back_with_its_camera(tmp_path, orientation):
    """Programs that make models read the stored picture; we read the upright one. What is seen where stays."""
    shoot(tmp_path / "plain")
    for path in sorted((tmp_path / "plain").iterdir()):
        spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, oiio.UINT8)
        spec["Orientation"] = orientation
        (tmp_path / "tagged").mkdir(exist_ok=True)
        file = oiio.ImageOutput.create("x.tif")
        assert file.open(str(tmp_path / "tagged" / f"{path.stem}.tif"), spec)
        file.write_image(np.rint(image_files.read_photo(path) * 255).astype(np.uint8))
        file.close()
    write_colmap(tmp_path / "m", [f"{n[:3]}.tif" for n in SCENE.names], sees=True)
    found = import_model(tmp_path / "m", tmp_path / "tagged", OPTIONS)
    upright = image_files.read_size(tmp_path / "tagged" / "000.tif")
    assert (found.lenses[0].width, found.lenses[0].height) == upright
    assert reprojection_errors(found.model).max() < 1e-4
    ground, c = synth.texture(np.random.default_rng(4)), found.model.cameras[0]
    exact = pycolmap.Camera(model="PINHOLE", width=c.width, height=c.height, params=[c.fx, c.fy, c.cx, c.cy])
    assert alike(undistort_image(found, 0), photograph(exact, c.rotation, c.translation, ground))


def test_a_world_of_large_coordinates_keeps_its_points_sharp(three, photos, tmp_path):
    far = np.array([5.1e6, 4.2e5, 300.0])
    values = reconstruction()
    for i, shot in enumerate(values[0]["shots"].values()):
        shot["translation"] = (SCENE.translations[i] - SCENE.rotations[i] @ far).tolist()
    del values[0]["points"]
    found = import_model(write_json(tmp_path / "r.json", values), photos, OPTIONS)
    near = three["colmap"].model
    assert abs(len(found.model.points) - len(near.points)) <= 0.01 * len(near.points)
    assert np.median(np.abs((found.model.points - far) @ WORLD[:, 2])) < 0.003


def test_many_photos_are_matched_with_those_near_them_only():
    def place(x, turned):
        turn = np.diag([1.0, -1, -1]) if turned else np.eye(3)
        return MatchedPhoto(Path(), "", 0, lens(), 0, turn, -turn @ [x, 0.0, 0.0])

    line = [place(float(i), False) for i in range(61)]
    pairs = find_near_pairs(line)
    assert all(i < j for i, j in pairs) and len(set(pairs)) == len(pairs)
    assert {j for i, j in pairs if i == 30} | {i for i, j in pairs if j == 30} >= set(range(20, 41)) - {30}
    assert max(j - i for i, j in pairs) <= points.NEAREST
    assert len(find_near_pairs(line[:60])) == 60 * 59 // 2
    opposed = [place(float(i), i % 2 == 1) for i in range(61)]
    assert all((j - i) % 2 == 0 for i, j in find_near_pairs(opposed))


def test_the_stage_goes_on_from_a_given_model(photos, tmp_path):
    write_colmap(tmp_path / "m", sees=False)
    facts = prepare_photos(photos, tmp_path / "out", OPTIONS, tmp_path / "m")
    assert facts.registered == 8 and facts.relief < 0.02
    stored = read_colmap_model(tmp_path / "out" / "sparse")
    assert len(stored.points) == facts.points
    assert np.median([c.centre[2] for c in stored.cameras]) == pytest.approx(1, abs=1e-9)


def test_loose_points_are_stored_with_the_others(photos, tmp_path):
    path = write_json(tmp_path / "r.json", reconstruction())
    facts = prepare_photos(photos, tmp_path / "out", OPTIONS, path)
    stored = read_colmap_model(tmp_path / "out" / "sparse")
    assert len(stored.points) == facts.points and np.isfinite(stored.points).all()
    places, colours = triangulate_points(stored, stored.names)
    assert 100 < len(places) < len(stored.points)
