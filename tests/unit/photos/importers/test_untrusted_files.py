"""Models from outside that are damaged or ill meant: one message that names the file and what is wrong in it."""

import copy
import struct

import numpy as np
import pycolmap
import pytest
from fixtures import imported_models as made

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.importers import import_model


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """Photos without content: nothing here gets as far as to look at them."""
    folder = tmp_path_factory.mktemp("photos")
    for name in made.SCENE.names:
        image_files.write_png(folder / name, np.zeros((made.HEIGHT, made.WIDTH, 3)))
    return folder


def refused(path, photos, match):
    with pytest.raises(InputError, match=match) as caught:
        import_model(path, photos, made.OPTIONS)
    assert path.name in str(caught.value) and "\n" not in str(caught.value)


def put(values, where, value):
    """A copy of nested values with one of them replaced, or taken out where `value` is ...."""
    values = copy.deepcopy(values)
    inner = values
    for key in where[:-1]:
        inner = inner[key]
    if value is ...:
        del inner[where[-1]]
    else:
        inner[where[-1]] = value
    return values


SHEARED = (np.eye(4) + np.diag([0.01, 0, 0], 1)).tolist()


@pytest.mark.parametrize(
    "where, value, match",
    [
        (["frames"], 7, "neither a transforms.json"),
        (["frames", 2], "x", "frame 2: Input should be an object"),
        (["frames", 2, "file_path"], "../..", "'../..' is no name of a picture"),
        (["frames", 2, "file_path"], "./001.png", "001.png are one photo"),
        (["frames", 2, "transform_matrix"], [[1, 2], [3, 4]], "frame 2: transform_matrix.0.2: Field required"),
        (["frames", 2, "transform_matrix"], SHEARED, "frame 002.png: transform_matrix: its rotation is none"),
        (["frames", 2, "transform_matrix"], np.diag([-1.0, 1, 1, 1]).tolist(), "frame 002.png: .*rotation is none"),
        (["frames", 2, "transform_matrix", 0, 3], float("nan"), "NaN is no finite number"),
        (["frames", 2, "transform_matrix", 0, 3], 10**400, "too large a number"),
        (["frames", 2, "transform_matrix", 3], [0, 0, 1, 1], "its last row is not 0 0 0 1"),
        (["fl_x"], ..., "frame 000.png: neither fl_x nor camera_angle_x"),
        (["fl_x"], -300, "frame 000.png: focal lengths -300"),
        (["frames", 2, "camera_angle_x"], 4.0, "frame 002.png: camera_angle_x: Input should be less than 3.14"),
        (["w"], 0, "frame 000.png: pictures of 0 x"),
        (["k4"], 0.1, "frame 000.png: k4 is not read with camera_model OPENCV"),
        (["camera_model"], "EQUIRECTANGULAR", "camera_model EQUIRECTANGULAR is not read"),
    ],
)
def test_transforms_that_cannot_be_are_refused_by_key(photos, tmp_path, where, value, match):
    refused(made.write_json(tmp_path / "transforms.json", put(made.transforms(), where, value)), photos, match)


@pytest.mark.parametrize(
    "where, value, match",
    [
        ([0, "cameras"], ..., "no reconstruction with `shots` and `cameras`"),
        ([0, "cameras", "v2 brown", "projection_type"], "spherical", "camera 'v2 brown': projection_type spherical"),
        ([0, "shots", "002.png", "camera"], "v3", "shot 002.png: there is no camera 'v3'"),
        ([0, "shots", "002.png", "rotation"], [1, 2], "shot 002.png: rotation.2: Field required"),
        ([0, "shots", "002.png", "translation", 0], float("nan"), "NaN is no finite number"),
        ([0, "shots", "C:\\"], {}, "is no name of a picture"),
        ([0, "shots", "a\0b.png"], {}, "is no name of a picture"),
        ([0, "cameras", "v2 brown", "width"], 999999, "pixels; 1 pixel to"),
        ([0, "shots", "002.png", "rotation"], [1e6, 0, 0], "shot 002.png: rotation.0: Input should be less"),
        (
            [0, "reference_lla"],
            {"latitude": 95, "longitude": 0, "altitude": 0},
            "lla: latitude: Input should be less",
        ),
    ],
)
def test_reconstructions_that_cannot_be_are_refused_by_key(photos, tmp_path, where, value, match):
    values = put(made.reconstruction(), where, value)
    refused(made.write_json(tmp_path / "reconstruction.json", values), photos, match)


@pytest.mark.parametrize(
    "text, match",
    [
        ("[" * 100_000, "not readable as JSON"),
        ('[{"a": 1}]', "neither a transforms.json"),
    ],
)
def test_other_files_are_refused(photos, tmp_path, text, match):
    (tmp_path / "some.json").write_bytes(text.encode("latin-1"))
    refused(tmp_path / "some.json", photos, match)


def test_files_that_are_not_there_or_too_large_are_refused(photos, tmp_path):
    refused(tmp_path / "nowhere.json", photos, "there is no such file")
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", photos, "no COLMAP model in this folder")
    with (tmp_path / "huge.json").open("wb") as file:
        file.truncate(1 << 40)
    refused(tmp_path / "huge.json", photos, "bytes; at most")
    with pytest.raises(InputError, match="nowhere: there is no such folder of photos"):
        import_model(tmp_path / "empty", tmp_path / "nowhere", made.OPTIONS)


@pytest.mark.parametrize(
    "file, old, new, match",
    [
        ("cameras", "300.0 302.0", "-300.0 302.0", "camera 3: focal lengths -300"),
        ("images", " 3 000.png", " 4 000.png", "not readable as a COLMAP model"),
        ("images", "001.png", "../", "'../' is no name of a picture"),
        ("images", "\n5 ", "\n5 2", "image 000.png: its rotation is none"),
        ("points3D", "\n100 ", "\nx ", "not readable as a COLMAP model"),
    ],
)
def test_text_models_that_cannot_be_are_refused_by_file(photos, tmp_path, file, old, new, match):
    made.write_colmap(tmp_path / "m", sees=True)
    path = tmp_path / "m" / f"{file}.txt"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=rf"(cameras|images|points3D|\*).txt: .*{match}"):
        import_model(tmp_path / "m", photos, made.OPTIONS)


@pytest.fixture(scope="module")
def binary(tmp_path_factory):
    folder = tmp_path_factory.mktemp("binary")
    made.write_colmap(folder / "text", sees=True)
    pycolmap.Reconstruction(str(folder / "text")).write_binary(str(folder))
    return {name: (folder / f"{name}.bin").read_bytes() for name in ("cameras", "images", "points3D")}


@pytest.mark.parametrize("file", ["cameras", "images", "points3D"])
def test_damaged_binary_models_are_refused_by_file(photos, tmp_path, binary, file):
    whole = binary[file]
    for name, content in binary.items():
        (tmp_path / f"{name}.bin").write_bytes(content)
    for damaged in (whole[:-1], whole + b"x", struct.pack("<Q", 10**9) + whole[8:]):
        (tmp_path / f"{file}.bin").write_bytes(damaged)
        with pytest.raises(InputError, match=rf"{file}.bin: "):
            import_model(tmp_path, photos, made.OPTIONS)
