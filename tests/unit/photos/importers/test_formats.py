"""What single formats say in their own ways: several reconstructions, intrinsics of a frame, moved worlds, clouds."""

import numpy as np
import pycolmap
import pytest
from fixtures import imported_models as made
from plyfile import PlyData, PlyElement

from dav_gswt.photos.importers import import_model
from dav_gswt.photos.importers.colmap import import_colmap
from dav_gswt.photos.importers.nerfstudio import import_nerfstudio
from dav_gswt.photos.importers.photo_matching import PhotoFolder


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    made.shoot(folder)
    return folder


def test_of_several_reconstructions_the_largest_is_taken_and_the_others_are_said(photos, tmp_path, caplog):
    whole, rest = made.reconstruction()[0], made.reconstruction()[0]
    whole["shots"] = dict(list(whole["shots"].items())[:6])
    rest["shots"] = dict(list(rest["shots"].items())[6:])
    found = import_model(made.write_json(tmp_path / "r.json", [rest, whole]), photos, made.OPTIONS)
    assert found.model.names == made.SCENE.names[:6]
    assert [n for n, _ in found.left_out] == list(made.SCENE.names[6:])
    assert all("another, smaller reconstruction" in reason for _, reason in found.left_out)
    assert "reconstruction 0 with 2 images is left out" in caplog.text


def test_a_reference_makes_the_world_metric(photos, tmp_path):
    values = made.reconstruction()
    values[0]["reference_lla"] = {"latitude": 48.1, "longitude": 11.5, "altitude": 520.0}
    found = import_model(made.write_json(tmp_path / "r.json", values), photos, made.OPTIONS)
    assert (found.positions.about.latitude, found.positions.about.metres_per_unit) == (48.1, 1.0)
    assert found.positions.at == pytest.approx(np.array([c.centre for c in found.model.cameras]))


def test_a_reference_of_zeros_is_no_place(photos, tmp_path, caplog):
    """OpenSfM counts photos without GPS from 0, 0."""
    values = made.reconstruction()
    values[0]["reference_lla"] = {"latitude": 0.0, "longitude": 0.0, "altitude": 0.0}
    caplog.set_level("INFO")
    assert import_model(made.write_json(tmp_path / "r.json", values), photos, made.OPTIONS).positions is None
    assert "no place is known" in caplog.text


def test_frames_may_have_intrinsics_of_their_own_and_a_field_of_view_instead(photos, tmp_path):
    values = made.transforms()
    angle = 2 * np.arctan(0.5 * made.WIDTH / 310.0)
    values["frames"][3] |= {"camera_angle_x": angle, "fl_y": 311.0, "cx": 150.0, "k1": 0.0, "camera_model": "OPENCV"}
    given = import_nerfstudio(tmp_path / "t.json", values, photos, PhotoFolder(photos).stored_size)
    assert given.shots[3].lens.params == pytest.approx(
        np.array([310, 311, 150, *made.NUMBERS[3:4], 0, *made.NUMBERS[5:]])
    )
    assert given.shots[2].lens.params == pytest.approx(np.array(made.NUMBERS))


def test_a_file_without_sizes_takes_those_of_the_photos(photos, tmp_path):
    values = {
        "camera_angle_x": 2 * np.arctan(0.5 * made.WIDTH / 300.0),
        "frames": made.transforms(move=np.eye(4)[:3])["frames"],
    }
    for frame in values["frames"]:
        frame["file_path"] = "./train/" + frame["file_path"].removesuffix(".png")  # Blender's scenes name no suffix
    given = import_nerfstudio(tmp_path / "t.json", values, photos, PhotoFolder(photos).stored_size)
    assert given.shots[0].lens.model_name == "PINHOLE"
    assert given.shots[0].lens.params == pytest.approx(np.array([300, 300, made.WIDTH / 2, made.HEIGHT / 2]))
    assert given.shots[4].translation == pytest.approx(made.SCENE.translations[4])


def test_an_applied_scale_is_undone_too(photos, tmp_path):
    values = made.transforms()
    for frame in values["frames"]:
        matrix = np.array(frame["transform_matrix"])
        matrix[:3, 3] *= 2.5
        frame["transform_matrix"] = matrix.tolist()
    values["applied_scale"] = 2.5
    given = import_nerfstudio(tmp_path / "t.json", values, photos, PhotoFolder(photos).stored_size)
    assert np.array([s.translation for s in given.shots]) == pytest.approx(made.SCENE.translations)


@pytest.mark.parametrize("moved", [True, False], ids=["moved with the cameras", "left where they were"])
@pytest.mark.parametrize("text", [True, False], ids=["text", "binary"])
def test_points_beside_transforms_are_brought_into_the_cameras_world(photos, tmp_path, moved, text):
    places = made.SCENE.points @ made.MOVE[:, :3].T + made.MOVE[:, 3] if moved else made.SCENE.points
    rows = np.empty(len(places), [(a, "f8") for a in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")])
    for j, axis in enumerate("xyz"):
        rows[axis] = places[:, j]
    rows["red"], rows["green"], rows["blue"] = 51, 102, 204
    PlyData([PlyElement.describe(rows, "vertex")], text=text).write(str(tmp_path / "sparse_pc.ply"))
    values = made.transforms() | {"ply_file_path": "sparse_pc.ply"}
    given = import_nerfstudio(tmp_path / "t.json", values, photos, PhotoFolder(photos).stored_size)
    assert given.points == pytest.approx(made.SCENE.points, abs=1e-5)
    assert given.colours[0] == pytest.approx([0.2, 0.4, 0.8], abs=1e-6)


def test_a_rig_of_cameras_is_read_by_its_images(photos, tmp_path):
    """What rigs and frames say is in the images' own poses already."""
    stored = pycolmap.Reconstruction()
    camera = made.lens()
    camera.camera_id = 1
    other = made.lens()
    other.camera_id = 2
    stored.add_camera(camera)
    stored.add_camera(other)
    rig = pycolmap.Rig(rig_id=1)
    rig.add_ref_sensor(camera.sensor_id)
    apart = pycolmap.Rigid3d(np.c_[np.eye(3), [0.1, 0.0, 0.0]])
    rig.add_sensor(other.sensor_id, apart)
    stored.add_rig(rig)
    for i in range(4):
        frame = pycolmap.Frame(frame_id=i + 1, rig_id=1)
        pair = [pycolmap.Image(name=f"{2 * i + k:03d}.png", camera_id=k + 1, image_id=2 * i + k + 1) for k in (0, 1)]
        for image in pair:
            frame.add_data_id(image.data_id)
        frame.rig_from_world = pycolmap.Rigid3d(np.c_[made.SCENE.rotations[2 * i], made.SCENE.translations[2 * i]])
        stored.add_frame(frame)
        for image in pair:
            image.frame_id = i + 1
            stored.add_image(image)
        stored.register_frame(i + 1)
    (tmp_path / "b").mkdir()
    stored.write_binary(str(tmp_path / "b"))
    given = import_colmap(tmp_path / "b", photos)
    by_name = {s.name: s for s in given.shots}
    for i in range(4):
        t = made.SCENE.translations[2 * i]
        assert by_name[f"{2 * i:03d}.png"].translation == pytest.approx(t, abs=1e-12)
        assert by_name[f"{2 * i + 1:03d}.png"].translation == pytest.approx(t + [0.1, 0, 0], abs=1e-12)
