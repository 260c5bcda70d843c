"""Text files, mutated: camera models, what stages write for one another, the config."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pycolmap
import pytest
import yaml
from fixtures import imported_models
from fixtures.frames import scene_frame
from fixtures.fuzzing import (
    VALUES,
    all_finite,
    empty_folder,
    fuzz,
    mutate_bytes,
    mutate_json,
    randoms,
    read_guarded,
    write_bytes,
)
from hypothesis import given

from dav_gswt.capture.store import PhotoStore
from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.geometry.camera_layouts import orbit
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import read_scene_frame, write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos import importers
from dav_gswt.photos.capture_record import CapturedPhoto, read_capture_record, write_capture_record
from dav_gswt.photos.importers.photo_matching import PhotoFolder
from dav_gswt.photos.lenses import Lens, read_lenses, write_lenses
from dav_gswt.photos.training_views import read_captured_views
from dav_gswt.photos.view_split import ViewSplit, read_view_split, write_view_split
from dav_gswt.views.frozen_scales import FrozenScales, read_frozen_scales, write_frozen_scales
from dav_gswt.views.scores import Scores, read_scores, write_scores
from dav_gswt.views.selection import PoseSelection, read_pose_selection, write_pose_selection
from dav_gswt.views.uncertainty.weighting import Quantiles, Scales

POSE = Pose("pose_0001", 60.0, 10.0, 4.0)
CAMERA = orbit(60.0, 10.0, 4.0, (0.0, 0.0, 0.0), 8, 6, 60.0)


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    for name in imported_models.SCENE.names:
        image_files.write_png(folder / name, np.zeros((imported_models.HEIGHT, imported_models.WIDTH, 3)))
    return PhotoFolder(folder)


def is_model(model) -> None:
    assert all_finite(model.points, model.colours)
    for shot in model.shots:
        assert all_finite(shot.rotation, shot.translation) and ".." not in shot.name.split("/")
        assert np.abs(shot.rotation @ shot.rotation.T - np.eye(3)).max() < 1e-6
        assert shot.lens is None or all_finite(shot.lens.params) and shot.lens.width * shot.lens.height <= 2e8


@pytest.mark.parametrize("kind", ["transforms", "reconstruction"])
@fuzz
@given(random=randoms)
def test_models_of_other_programs(photos, tmp_path, kind, random):
    values = getattr(imported_models, kind)()
    path = write_bytes(empty_folder(tmp_path) / "model.json", mutate_json(random, values))
    name = {"transforms": "nerfstudio", "reconstruction": "OpenSfM"}[kind]
    read_guarded(
        name, lambda: importers._read_model(path, photos), is_model, path.stat().st_size, "model.json", folder=tmp_path
    )


def is_camera(camera) -> bool:
    numbers = camera.fx, camera.fy, camera.cx, camera.cy
    shapes = camera.rotation.shape == (3, 3) and camera.translation.shape == (3,)
    whole = all(type(n) is int and n > 0 for n in (camera.width, camera.height))
    return shapes and whole and all_finite(camera.rotation, camera.translation, numbers)


def is_pose(pose) -> bool:
    return isinstance(pose.name, str) and all_finite(pose.elevation, pose.azimuth, pose.radius)


def is_record(shots) -> None:
    for shot in shots:
        assert is_camera(shot.camera) and is_camera(shot.requested) and is_pose(shot.pose)
        assert Path(shot.name).name == shot.name and np.isfinite(shot.distance)


def is_selection(selection) -> None:
    assert all(map(is_pose, selection.poses)) and isinstance(selection.k, int)
    json.dumps(asdict(selection), allow_nan=False)


def is_frame(frame) -> None:
    assert all_finite(list(asdict(frame.exemplar).values()), list(asdict(frame.extent).values()), frame.flying_height)
    write = {key: value for key, value in asdict(frame).items() if key != "georeference"}
    json.dumps(write, allow_nan=False)


def is_split(split) -> None:
    assert all(isinstance(name, str) for name in (*split.start, *split.pool, *split.test))


def are_lenses(lenses) -> None:
    for lens in lenses:
        assert all_finite(lens.camera.params, lens.pinhole) and len(lens.pinhole) == 6


def are_scales(frozen) -> None:
    assert all_finite(list(frozen.scales.by_term.values()))
    assert frozen.pixels is None or all_finite(frozen.pixels.low, frozen.pixels.high)


WRITERS = {
    "ground.json": lambda folder: write_scene_frame(folder / "ground.json", scene_frame()),
    "views.json": lambda folder: write_view_split(folder / "views.json", ViewSplit(("a.png",), ("b.png",), ("c.png",))),
    "poses.json": lambda folder: write_pose_selection(folder / "poses.json", PoseSelection("farthest", 2, [POSE])),
    "capture.json": lambda folder: write_capture_record(
        folder, "render", [CapturedPhoto("pose_0001.png", POSE, CAMERA, CAMERA, 0.0)]
    ),
    "lenses.json": lambda folder: write_lenses(
        folder, [Lens(pycolmap.Camera(model="OPENCV", width=8, height=6, params=[9.0] * 4 + [0.0] * 4), (9.0,) * 6)]
    ),
    "scores.json": lambda folder: write_frozen_scales(
        folder / "scores.json", FrozenScales(Scales({"opacity": 1.0}), Quantiles(0.1, 0.9)), {}, {}, {}
    ),
}
READERS = {
    "ground.json": (lambda folder: read_scene_frame(folder / "ground.json"), is_frame),
    "views.json": (lambda folder: read_view_split(folder / "views.json"), is_split),
    "poses.json": (lambda folder: read_pose_selection(folder / "poses.json"), is_selection),
    "capture.json": (read_capture_record, is_record),
    "lenses.json": (read_lenses, are_lenses),
    "scores.json": (lambda folder: read_frozen_scales(folder / "scores.json"), are_scales),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The values of every file as its stage writes them."""
    folder = tmp_path_factory.mktemp("written")
    for writer in WRITERS.values():
        writer(folder)
    return {name: json.loads((folder / name).read_text(encoding="utf-8")) for name in WRITERS}


@pytest.mark.parametrize("name", READERS)
@fuzz
@given(random=randoms)
def test_files_between_stages(written, tmp_path, name, random):
    read, check = READERS[name]
    folder = empty_folder(tmp_path)
    path = write_bytes(folder / name, mutate_json(random, written[name]))
    read_guarded(name, lambda: read(folder), check, path.stat().st_size, name, folder=folder)


@fuzz
@given(random=randoms)
def test_photos_of_a_round(written, tmp_path, random):
    """The pictures that capture.json names are read from its own folder alone."""
    folder = empty_folder(tmp_path)
    image_files.write_png(folder / "pose_0001.png", np.full((6, 8, 3), 0.5))
    path = write_bytes(folder / "capture.json", mutate_json(random, written["capture.json"]))

    def check(views):
        assert all(np.isfinite(view.image).all() for view in views)

    read_guarded("photos of a round", lambda: read_captured_views(folder, 8), check, path.stat().st_size, folder=folder)


@fuzz
@given(random=randoms)
def test_photos_of_the_store(tmp_path, random):
    folder = empty_folder(tmp_path)
    image_files.write_png(folder / "a.png", np.full((6, 8, 3), 0.5))
    store = PhotoStore(folder / "store")
    (folder / "store").mkdir()
    stored = store.add(folder / "a.png", "shots", (POSE, CAMERA), CAMERA, "2026-01-01T00:00:00")
    record = stored.photo.with_name("shot.json")
    write_bytes(record, mutate_json(random, json.loads(record.read_text(encoding="utf-8"))))

    def check(found):
        assert all(is_camera(photo.camera) and photo.photo.parent == record.parent for photo in found)

    size = record.stat().st_size
    read_guarded("shot.json", lambda: store.photos_of(CAMERA), check, size, str(record.parent.name), folder=folder)


@fuzz
@given(random=randoms)
def test_scores(tmp_path, random):
    folder = empty_folder(tmp_path)
    terms = {"opacity": np.array([0.1, 0.2]), "gradient": np.array([1.0, 2.0])}
    poses = [POSE, Pose("pose_0002", 45.0, 20.0, 4.0)]
    scales = Scales({"opacity": 1.0, "gradient": 2.0})
    write_scores(folder / "scores.csv", Scores(poses, terms, scales, np.array([0, 4])))
    path = write_bytes(folder / "scores.csv", mutate_bytes(random, (folder / "scores.csv").read_bytes(), 400))

    def check(scores):
        assert all_finite(*scores.terms.values(), list(scores.scales.by_term.values())) and all(
            map(is_pose, scores.poses)
        )

    read_guarded("scores.csv", lambda: read_scores(path), check, path.stat().st_size, "scores.csv", folder=folder)


FRAGMENTS = (
    *("scene: &a [*a]\n", "stop: &a {b: *a}\n", "scene: !!python/object/apply:os.system [x]\n", "seeds: 2001-99-99\n"),
    *(
        "k: 0b_\n",
        "k: !!int x\n",
        "k: !!float y\n",
        "tau: .nan\n",
        "tau: .inf\n",
        "k: !!bool z\n",
        "? [a]\n: b\n",
        "<<: 3\n",
    ),
    *(
        "k: 1e999\n",
        "k: 99999999999999999999\n",
        "k: 1:99\n",
        "k: 0x\n",
        "\t- a\n",
        "%YAML 9\n",
        "\0",
        "--- 1\n--- 2\n",
    ),
    *(
        "k: !!timestamp x\n",
        "k: !!binary '*'\n",
        "k: !!set 3\n",
        "1: 2\n",
        "null: 1\n",
        "scenes: {3: {}}\n",
        "[" * 3000,
    ),
    *("scenes: []\n", "presets: {draft: 7}\n", "k: " + "9" * 5000 + "\n", "scenes:\n  x: null\n", "? {a: b}\n: c\n"),
)


def mutate_config(random, values: dict, text: str) -> bytes:
    what = random.randrange(4)
    if what == 0:
        return mutate_bytes(random, text.encode(), len(text))
    if what == 1:
        place = text.find("\n", random.randrange(len(text))) + 1
        return (text[:place] + random.choice(FRAGMENTS) + text[place:]).encode()
    if what == 2:
        inner = random.choice([values, *(v for v in values.values() if isinstance(v, dict) and v)])
        inner = dict(inner) | {random.choice([*map(str, inner), "x"]): random.choice(VALUES)}
        return json.dumps(inner if random.random() < 0.5 else values | {random.choice(list(values)): inner}).encode()
    return mutate_json(random, values)


@pytest.fixture(scope="module")
def config_text(root):
    return (root / "config/config.yaml").read_text(encoding="utf-8")


@fuzz
@given(random=randoms)
def test_configs(root, config_text, tmp_path, random):
    path = write_bytes(
        empty_folder(tmp_path) / "config.yaml", mutate_config(random, yaml.safe_load(config_text), config_text)
    )

    def read():
        config = add_scene_files(read_config([path]), root / "config/scenes")
        return check_config(config)

    def check(config):
        json.dumps(config, allow_nan=False)
        assert check_config(config) == config

    read_guarded("config", read, check, path.stat().st_size, "config")
