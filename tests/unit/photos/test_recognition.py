"""What somebody brings is recognised by its content."""

import zipfile

import pytest

from dav_gswt.errors import InputError
from dav_gswt.images.file_kinds import detect_kind
from dav_gswt.photos.recognition import recognize_input

JPEG, HEIC = b"\xff\xd8\xff\xe0" + b"0" * 40, b"\0\0\0\x18ftypheic" + b"0" * 40
MP4, GAUSSIANS = b"\0\0\0\x18ftypisom" + b"0" * 40, b"ply\nformat binary_little_endian 1.0\nproperty float f_dc_0\n"


def write(folder, **files):
    for name, content in files.items():
        path = folder / name.replace("__", "/").replace("_dot_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder


def photos(folder, count=3):
    return write(folder, **{f"{i}_dot_jpg": JPEG for i in range(count)})


def test_kinds_come_from_the_first_bytes_not_from_the_name(tmp_path):
    cases = {"a.jpg": (HEIC, "heif"), "b.heic": (JPEG, "photo"), "c.bin": (MP4, "video"), "d.ply": (b"ply\n", "ply")}
    cases |= {"e.dng": (b"II*\0" + b"0" * 40, "raw"), "f.mov": (b"\0\0\0\x08wide" + b"0" * 40, "video")}
    cases |= {"g.txt": (b"hello", "other"), "h.spz": (b"\x1f\x8b\x08" + b"0" * 40, "spz"), "empty.jpg": (b"", "other")}
    for name, (content, kind) in cases.items():
        (tmp_path / name).write_bytes(content)
        assert detect_kind(tmp_path / name) == kind, name
    with zipfile.ZipFile(tmp_path / "x.sog", "w") as archive:
        archive.writestr("meta.json", "{}")
    assert detect_kind(tmp_path / "x.sog") == "sog"


def test_a_folder_of_photos_with_subfolders_and_masks(tmp_path):
    folder = write(
        photos(tmp_path / "Sand pit"), day2__a_dot_heic=HEIC, masks__0_dot_png=JPEG, _dot_hidden_dot_jpg=JPEG
    )
    found = recognize_input([folder])
    assert found.name == "Sand_pit" and found.about == "4 photos (HEIC among them) and masks"
    assert found.entry == {"kind": "photos", "folder": str(folder)}


def test_videos_of_live_photos_belong_to_their_photos(tmp_path):
    folder = write(photos(tmp_path), IMG_1_dot_heic=HEIC, IMG_1_dot_mov=MP4)
    assert recognize_input([folder]).about == "4 photos (HEIC among them)"


def test_of_several_models_of_colmap_the_largest_is_taken_and_the_video_of_a_project_is_no_input(tmp_path):
    photos(tmp_path / "images")
    files = {f"sparse__{i}__{name}_dot_bin": b"x" * i for i in range(3) for name in ("cameras", "images")}
    found = recognize_input([write(tmp_path, walk_dot_mp4=MP4, **files)])
    assert found.entry["model"] == str(tmp_path / "sparse/2")


def test_several_files_are_photos(tmp_path):
    folder = photos(tmp_path / "a", 2)
    more = photos(tmp_path / "b", 1)
    found = recognize_input([folder, more / "0.jpg"])
    assert found.entry["folder"] == [str(folder), str(more / "0.jpg")] and found.about == "3 photos"


def test_a_video_and_a_splat(tmp_path):
    write(tmp_path, walk_dot_mp4=MP4, splat_dot_ply=GAUSSIANS)
    assert recognize_input([tmp_path / "walk.mp4"]).about == "a video"
    assert recognize_input([tmp_path / "splat.ply"]).entry == {"kind": "field", "field": str(tmp_path / "splat.ply")}


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "no photos"),
        ({"0_dot_jpg": JPEG}, "only 1 photos; at least 3"),
        (
            {"walk_dot_mp4": MP4, **{f"{i}_dot_jpg": JPEG for i in range(3)}},
            "several things at once, photos .* and a video",
        ),
        ({"s_dot_ply": GAUSSIANS, **{f"{i}_dot_jpg": JPEG for i in range(3)}}, "photos .* and a splat"),
        ({"a_dot_mp4": MP4, "b_dot_mp4": MP4}, "has several, a.mp4, b.mp4; name one"),
        ({"transforms_dot_json": b"{}"}, "cameras of nerfstudio, but no photos"),
        (
            {
                "transforms_dot_json": b"{}",
                "sparse__cameras_dot_txt": b"",
                "sparse__images_dot_txt": b"",
                **{f"images__{i}_dot_jpg": JPEG for i in range(3)},
            },
            "COLMAP .* and nerfstudio .*; say which with --model",
        ),
    ],
)
def test_what_is_not_understood_is_said(tmp_path, files, message):
    with pytest.raises(InputError, match=message):
        recognize_input([write(tmp_path, **files)])


def test_a_point_cloud_beside_photos_is_no_splat(tmp_path):
    folder = write(photos(tmp_path), cloud_dot_ply=b"ply\nformat ascii 1.0\nproperty float x\n")
    assert recognize_input([folder]).about == "3 photos"
    with pytest.raises(InputError, match="a mesh or point cloud"):
        recognize_input([folder / "cloud.ply"])


def test_splats_that_are_not_read_are_named_with_what_converts_them(tmp_path):
    command = "convert it: npx @playcanvas/splat-transform"
    with zipfile.ZipFile(tmp_path / "a.sog", "w") as archive:
        archive.writestr("meta.json", "{}")
    with pytest.raises(InputError, match=f"is a SOG .*{command} .*a.sog a.ply"):
        recognize_input([tmp_path / "a.sog"])
    folder = write(tmp_path / "open", meta_dot_json=b"{}", means_l_dot_webp=b"RIFF0000WEBP")
    with pytest.raises(InputError, match=f"is a SOG .*{command} .*meta.json open.ply"):
        recognize_input([folder])
