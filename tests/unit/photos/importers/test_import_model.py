"""Camera models of other programs: one made-up scene in three formats, the same cameras, pictures and points."""

import unicodedata
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
from fixtures import imported_models as made
from fixtures.imported_models import (
    HEIGHT,
    NUMBERS,
    SCENE,
    WIDTH,
    reconstruction,
    shoot,
    transforms,
    write_colmap,
    write_json,
)

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.images import image_files
from dav_gswt.photos import importers
from dav_gswt.photos.colmap_model import reprojection_errors
from dav_gswt.photos.ground_frame import fit_ground_frame
from dav_gswt.photos.importers import import_model
from dav_gswt.photos.importers.nerfstudio import import_nerfstudio
from dav_gswt.photos.importers.photo_matching import PhotoFolder, match_photos_to_images
from dav_gswt.photos.recognition import recognize_input

OPTIONS = replace(made.OPTIONS, features=500)


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    shoot(folder)
    return folder


@pytest.fixture(scope="module")
def found_once():
    """Triangulates the features of the scene's photos once, since their cameras are the same in all formats."""
    found, find_points = [], importers._find_points

    def triangulate(*arguments):
        found.append(found[0] if found else find_points(*arguments))
        return found[0]

    return triangulate


@pytest.fixture(scope="module")
def three(photos, found_once, tmp_path_factory):
    """The scene read from each of the three formats."""
    folder = tmp_path_factory.mktemp("models")
    write_colmap(folder / "colmap")
    sources = {
        "colmap": folder / "colmap",
        "nerfstudio": write_json(folder / "transforms.json", transforms()),
        "opensfm": write_json(folder / "reconstruction.json", reconstruction()),
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importers, "_find_points", found_once)
        return {kind: import_model(path, photos, OPTIONS) for kind, path in sources.items()}


@pytest.mark.parametrize("kind", ["colmap", "nerfstudio", "opensfm"])
def test_cameras_pictures_and_points_are_those_of_the_scene(three, kind):
    found, one = three[kind], three["colmap"]
    assert found.model.names == SCENE.names and not found.left_out
    for i, camera in enumerate(found.model.cameras):
        assert camera.rotation == pytest.approx(SCENE.rotations[i], abs=1e-9)
        assert camera.translation == pytest.approx(SCENE.translations[i], abs=1e-9)
    assert found.lenses[0].params == pytest.approx(np.array(NUMBERS), abs=1e-9)
    a, b = one.model.cameras[5], found.model.cameras[5]
    assert [a.fx, a.fy, a.cx, a.cy, a.width, a.height] == pytest.approx([b.fx, b.fy, b.cx, b.cy, b.width, b.height])
    assert found.model.points == pytest.approx(one.model.points, abs=1e-5)


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


def test_names_are_found_by_path_then_by_stem(tmp_path):
    files = ["a/1.jpg", "b/1.jpg", "b/2.png", "c/3.v2.jpg", "c/.hidden/4.jpg"]
    for name in files:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        image_files.write_png(tmp_path / name, np.zeros((4, 4, 3)))
    found = PhotoFolder(tmp_path)
    assert [found.find(n) for n in ("a/1.jpg", "x/2.png", "2.JPG", "3.v2")] == [
        *("a/1.jpg", "b/2.png", "b/2.png", "c/3.v2.jpg")
    ]
    image_files.write_png(tmp_path / unicodedata.normalize("NFD", "düne.png"), np.zeros((4, 4, 3)))
    assert PhotoFolder(tmp_path).find("düne.png") == "düne.png"  # composed in the model, not on the disk
    assert found.find("1.jpg") is None and found.find("4") is None  # of two photos, of none


@pytest.mark.parametrize(
    "path",
    ["images/{}", "C:\\Users\\me\\site\\images\\{}", "/home/other/site/images/{}", "../site/images/{}"],
    ids=["relative", "windows", "linux", "parent"],
)
def test_paths_of_another_machine_name_the_photos_of_the_folder(photos, tmp_path, path):
    """No file outside the folder is read: the one that the path of frame 0 leads to is left alone."""
    frames = [frame | {"file_path": path.format(frame["file_path"][2:])} for frame in transforms()["frames"]]
    frames[0]["file_path"] = f"{tmp_path}/secret.png"
    image_files.write_png(tmp_path / "secret.png", np.zeros((HEIGHT, WIDTH, 3)))
    given = importers._read_model(
        write_json(tmp_path / "t.json", transforms() | {"frames": frames}), PhotoFolder(photos)
    )
    placed, left_out = match_photos_to_images(given, PhotoFolder(photos), tmp_path)
    assert [place.path for place in placed] == [photos / name for name in SCENE.names[1:]]
    assert {name for name, _ in left_out} == {f"{tmp_path}/secret.png"[1:], "000.png"}


def test_a_model_in_map_coordinates_gives_the_same_ground(photos, tmp_path):
    """Eastings and northings of millions of metres, cameras 40 metres high."""
    write_colmap(tmp_path / "plain", sees=True)
    stored = pycolmap.Reconstruction(str(tmp_path / "plain"))
    stored.transform(pycolmap.Sim3d(40.0, pycolmap.Rotation3d(), np.array([456789.25, 5234567.5, 420.0])))
    (tmp_path / "utm").mkdir()
    stored.write_binary(str(tmp_path / "utm"))
    rng = np.random.default_rng
    one, two = (fit_ground_frame(import_model(tmp_path / m, photos, OPTIONS).model, rng(0)) for m in ("plain", "utm"))
    assert two[0].points == pytest.approx(one[0].points, abs=1e-6)
    for a, b in zip(one[0].cameras, two[0].cameras, strict=True):
        assert a.centre == pytest.approx(b.centre, abs=1e-6)
    assert one[1].exemplar.side == pytest.approx(two[1].exemplar.side, abs=1e-6)


@pytest.mark.parametrize("program", ["COLMAP", "nerfstudio", "OpenSfM"])
def test_a_project_is_recognised_and_its_photos_have_cameras(tmp_path, program):
    """As these programs lay them out: nerfstudio keeps smaller copies beside the images."""
    shoot(tmp_path / "images")
    if program == "COLMAP":
        write_colmap(tmp_path / "sparse" / "0")
    elif program == "nerfstudio":
        shoot(tmp_path / "images_2", 0.5)
        frames = [frame | {"file_path": f"images/{frame['file_path'][2:]}"} for frame in transforms()["frames"]]
        write_json(tmp_path / "transforms.json", transforms() | {"frames": frames})
    else:
        (tmp_path / "opensfm").mkdir()
        write_json(tmp_path / "opensfm/reconstruction.json", reconstruction())
    found = recognize_input([tmp_path])
    assert found.about == f"8 photos with cameras of {program}"
    folder = PhotoFolder(Path(found.entry["folder"]))
    placed, _ = match_photos_to_images(importers._read_model(Path(found.entry["model"]), folder), folder, tmp_path)
    assert [place.path for place in placed] == [tmp_path / "images" / name for name in SCENE.names]


def test_a_turned_photo_is_turned_back_with_its_camera(tmp_path):
    """Programs that make models read the stored picture; we read the upright one. What is seen where stays."""
    shoot(tmp_path / "plain")
    for path in sorted((tmp_path / "plain").iterdir()):
        spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, oiio.UINT8)
        spec["Orientation"] = 6
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


def test_of_several_reconstructions_the_largest_is_taken_and_a_reference_makes_it_metric(photos, tmp_path, caplog):
    whole, rest = reconstruction()[0], reconstruction()[0]
    whole["shots"] = dict(list(whole["shots"].items())[:4])
    rest["shots"] = dict(list(rest["shots"].items())[5:])
    whole["reference_lla"] = {"latitude": 48.1, "longitude": 11.5, "altitude": 520.0}
    found = import_model(write_json(tmp_path / "r.json", [rest, whole]), photos, OPTIONS)
    assert found.model.names == SCENE.names[:4]
    assert [n for n, _ in found.left_out] == list(SCENE.names[4:])
    assert "3 images of other reconstructions are left out" in caplog.text
    assert (found.positions.about.latitude, found.positions.about.metres_per_unit) == (48.1, 1.0)
    assert found.positions.at == pytest.approx(np.array([c.centre for c in found.model.cameras]))
    whole["reference_lla"] = dict.fromkeys(whole["reference_lla"], 0.0)  # what OpenSfM counts from without GPS
    assert importers._read_model(write_json(tmp_path / "r.json", [whole]), PhotoFolder(photos)).about is None


def test_a_model_without_a_place_gets_metres_from_positions_that_agree(photos, tmp_path):
    for name in SCENE.names:
        (tmp_path / "images").mkdir(exist_ok=True)
        (tmp_path / "images" / name).symlink_to(photos / name)
    write_colmap(tmp_path / "sparse", sees=True)
    given = import_model(tmp_path / "sparse", tmp_path / "images", OPTIONS)
    centres = np.stack([camera.centre for camera in given.model.cameras])
    place, metres = Georeference(48.1, 11.5, 520.0, north=0.0, metres_per_unit=1.0), 200.0

    def write_places(at):
        rows = [
            f"{n} {p[1]:.9f} {p[0]:.9f} {p[2]:.6f}" for n, p in zip(given.model.names, place.to_earth(at), strict=True)
        ]
        (tmp_path / "geo.txt").write_text("\n".join(["EPSG:4326", *rows]))

    write_places(metres * centres)
    found = import_model(tmp_path / "sparse", tmp_path / "images", OPTIONS)
    assert given.positions is None and found.positions.about.latitude == pytest.approx(48.1, abs=0.01)
    moved = np.stack([camera.centre for camera in found.model.cameras])
    apart, apart_before = (np.linalg.norm(at[:, None] - at, axis=2) for at in (moved, centres))
    assert apart == pytest.approx(metres * apart_before, abs=0.01)
    assert found.error == pytest.approx(given.error, abs=1e-6)  # the cameras moved as one
    write_places(metres * centres[::-1] * [1, -1, 3])
    wrong = import_model(tmp_path / "sparse", tmp_path / "images", OPTIONS)
    assert wrong.positions is None
    assert [c.centre.tolist() for c in wrong.model.cameras] == [c.centre.tolist() for c in given.model.cameras]


def read_transforms(values, photos):
    return import_nerfstudio(Path("t.json"), values, PhotoFolder(photos).stored_size)


def test_a_file_without_sizes_takes_those_of_the_photos(photos):
    """Blender's scenes name no suffix."""
    frames = transforms()["frames"]
    for frame in frames:
        frame["file_path"] = "./train/" + frame["file_path"].removesuffix(".png")
    angle = 2 * np.arctan(0.5 * WIDTH / 300.0)
    given = read_transforms({"camera_angle_x": angle, "frames": frames}, photos)
    assert given.images[0].lens.model_name == "PINHOLE"
    assert given.images[0].lens.params == pytest.approx(np.array([300, 300, WIDTH / 2, HEIGHT / 2]))
    assert np.array([shot.translation for shot in given.images]) == pytest.approx(SCENE.translations)
