"""Inputs that fuzzing found: each once ended in another exception, a hang, or was taken for sound."""

import json
import shutil
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from fixtures import bundles
from fixtures.bundles import Ground
from fixtures.fuzzing import LONGEST

from dav_gswt.bundle.store import read_bundle
from dav_gswt.capture.store import PhotoStore
from dav_gswt.config.load import check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.geometry.camera_layouts import orbit
from dav_gswt.geometry.cameras import camera_to_json
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.lenses import read_lenses
from dav_gswt.photos.training_views import read_training_view
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views.scores import list_columns, read_frozen_scales, read_scores
from dav_gswt.views.selection import read_pose_selection

POSE = Pose("pose_0001", 60.0, 10.0, 4.0)
CAMERA = orbit(60.0, 10.0, 4.0, (0.0, 0.0, 0.0), 8, 6, 60.0)
SQUARE = {"west": 0, "south": 0, "side": 1}
FRAME = {"kind": "photos", "unit": "metre", "flying_height": 1, "exemplar": SQUARE}
FRAME |= {"extent": {"west": 0, "south": 0, "east": 1, "north": 1}}
SHOT = {"name": "a.png", "asked": asdict(POSE) | {"camera": camera_to_json(CAMERA)}, "got": camera_to_json(CAMERA)}
SHOT |= {"asked_to_got": 0.0, "taken": None}
LENS = {"model": "PINHOLE", "width": 8, "height": 6, "params": [9, 9, 4, 3], "pinhole": [9, 9, 4, 3, 8, 6]}
SELECTION = {"policy": "farthest", "k": 1, "poses": [asdict(POSE)]}
SCORES = f"{','.join(list_columns())}\na,{{}},1,1,{{}},,,,,,1,,,,,\n"


def read_found(path: Path):
    """Read a file by its name, as the workflow does."""
    return {
        "views.json": read_view_split,
        "ground.json": read_scene_frame,
        "poses.json": read_pose_selection,
        "capture.json": lambda path: read_capture_record(path.parent),
        "lenses.json": lambda path: read_lenses(path.parent),
        "scores.json": read_frozen_scales,
        "scores.csv": read_scores,
        "config.yaml": lambda path: check_config(read_config([path])),
    }[path.name](path)


def record(**changes) -> str:
    return json.dumps({"agent": "render", "shots": [SHOT | changes]})


def camera(**changes) -> dict:
    return {"got": camera_to_json(CAMERA) | changes}


@pytest.mark.parametrize(
    "name, text, message",
    [
        ("views.json", '{"start": ' + "[" * 100_000, "not readable as JSON"),
        ("views.json", '{"start": [], "pool": [NaN], "test": []}', "NaN is no finite number"),
        ("views.json", '{"start": [' + "9" * 4500 + "]}", "not readable as JSON"),
        ("ground.json", json.dumps(FRAME | {"relief": "x"}).replace('"x"', "1e999"), "1e999 is no finite number"),
        ("ground.json", json.dumps(FRAME | {"points": 10**400}), "too large a number"),
        ("poses.json", json.dumps(SELECTION | {"poses": [asdict(POSE) | {"radius": "far"}]}), "poses.0.radius: "),
        ("capture.json", record(name="../../outside.png"), "is no name of a file"),
        ("capture.json", record(name="a\0b.png"), "is no name of a file"),
        ("capture.json", record(**camera(width=8.5)), "not the record of a capture"),
        ("capture.json", record(**camera(fx=-1.0)), "out of range"),
        ("capture.json", record(**camera(rotation=[[1, 0, 0]] * 3)), "rotation is none"),
        ("capture.json", record(asked=asdict(POSE) | {"elevation": [], "camera": SHOT["got"]}), "elevation: "),
        ("lenses.json", "7", "not as the workflow writes it"),
        ("lenses.json", json.dumps([LENS | {"model": "BANANA"}]), "camera BANANA are not read"),
        ("lenses.json", json.dumps([LENS | {"params": [9]}]), "needs finite numbers"),
        ("scores.json", '{"scales": {"opacity": 1}, "pixels": {"low": 1, "high": 1' + "0" * 400 + "}}", "too large"),
        ("scores.csv", SCORES.format("nan", 1), "a pose is not finite"),
        ("scores.csv", "pose\udcff", "not a table of scores"),
        ("scores.csv", '"' + "x" * 200_000, "not a table of scores"),
        ("config.yaml", "seeds: 2001-99-99\n", "not YAML"),
        ("config.yaml", "k: 0b_\n", "not YAML"),
        ("config.yaml", "k: " + "[" * 3000 + "\n", "not YAML"),
    ],
    ids=lambda value: str(value)[:50],
)
def test_what_was_found_is_refused_by_name(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=message) as refusal:
        read_found(path)
    assert name in str(refusal.value) and "\n" not in str(refusal.value) and len(str(refusal.value)) < LONGEST


@pytest.fixture
def bundle(tmp_path):
    folder = tmp_path / "bundle"
    bundles.write_bundle(folder, Ground(discs=4))
    return folder


CHUNK = ("tiles", 0, "chunks", 0)


@pytest.mark.parametrize(
    "where, value, message",
    [
        (("tile_side",), np.nan, "no finite number"),
        (("encoding", "origin"), [0, 0, 1e300], "a length is beyond"),
        (("encoding", "log_scale"), [0, 1e300], "log_scale makes no sense"),
        (("tiles", 3, "z"), [0, 1e20], "a length is beyond"),
        ((*CHUNK, "count"), 16.0, "count"),
        (("tiles", 0, "orders"), [{"a": k} for k in range(20_000)], "a valid integer"),
        (("provenance",), {"a": 10**400}, "too large a number"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_manifests_that_were_found_are_refused_soon(bundle, where, value, message):
    path = bundle / "davgswt.json"
    manifest = inner = json.loads(path.read_text())
    for key in where[:-1]:
        inner = inner[key]
    inner[where[-1]] = value
    path.write_text(json.dumps(manifest))
    start = time.process_time()
    with pytest.raises(InputError, match=message) as refusal:
        read_bundle(bundle)
    assert time.process_time() - start < 2
    assert "davgswt.json" in str(refusal.value) and len(str(refusal.value)) < LONGEST


def test_a_photo_smaller_than_its_camera_is_refused(tmp_path):
    image_files.write_png(tmp_path / "a.png", np.zeros((6, 8, 3)))
    (tmp_path / "capture.json").write_text(record(**camera(height=65535)))
    (photo,) = read_capture_record(tmp_path)
    with pytest.raises(InputError, match="a.png: 8 x 6 pixels, its camera takes 8 x 65535"):
        read_training_view(photo.name, photo.camera, tmp_path / photo.name, 8)


@pytest.mark.parametrize("changes", [{"photo": "../../outside.png"}, {"photo": 3}, {"got": None}, {"sha256": ...}])
def test_no_photo_of_the_store_is_read_from_elsewhere(tmp_path, changes):
    image_files.write_png(tmp_path / "a.png", np.full((6, 8, 3), 0.5))
    store = PhotoStore(tmp_path / "store")
    store.folder.mkdir()
    place = store.add(tmp_path / "a.png", "shots", (POSE, CAMERA), CAMERA, "2026-01-01T00:00:00").photo.parent
    shutil.copyfile(place / "photo.png", place.parent / "outside.png")
    values = json.loads((place / "shot.json").read_text()) | changes
    (place / "shot.json").write_text(json.dumps({key: value for key, value in values.items() if value is not ...}))
    with pytest.raises(InputError, match="shot.json: not the record of a photo"):
        store.photos_of(CAMERA)
