"""Files from outside and between stages, mutated: splats, bundles, models, photos, weights, the config."""

import gzip
import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
import torch
import yaml
from fixtures import bundles, imported_models
from fixtures.bundles import Ground
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
from fixtures.prior_weights import write_weights
from fixtures.random_field import random_field
from hypothesis import given
from plyfile import PlyData, PlyElement
from torch import nn

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle, read_bundle
from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.export import splat_files
from dav_gswt.export.spool import Spool
from dav_gswt.field import GaussianField, Splats, read_field, write_field
from dav_gswt.files import write_json
from dav_gswt.geometry.camera_layouts import orbit
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files
from dav_gswt.photos import importers, photo_files
from dav_gswt.photos.capture_record import CapturedPhoto, read_capture_record, write_capture_record
from dav_gswt.photos.importers.colmap import import_colmap
from dav_gswt.photos.importers.photo_matching import PhotoFolder
from dav_gswt.photos.importers.splat_files import read_splat
from dav_gswt.prior import weights

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
PHOTO = ROOT / "resources/photos/brighton_beach/images/DJI_0018.jpg"
NETWORK = nn.Sequential(nn.Linear(3, 4), nn.Linear(4, 2))
POSE = Pose("pose_0001", 60.0, 10.0, 4.0)
PACKED = gzip.compress(np.array([0x5053474E, 3, 9], "<u4").tobytes() + bytes([0, 9, 0, 0]) + bytes(range(20)) * 9, 9)
CAMERA = orbit(60.0, 10.0, 4.0, (0.0, 0.0, 0.0), 8, 6, 60.0)
SHOTS = [CapturedPhoto("pose_0001.png", POSE, CAMERA, CAMERA, 0.0)]


@dataclass(frozen=True)
class Reader:
    """A kind of file. write: valid ones to a folder; header: bytes in which half of the changes are; 0: it is JSON."""

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], Any]
    is_right: Callable[[Any], bool]
    header: int = 0


def is_sound(field: GaussianField) -> bool:
    """Whether a field is finite and in range."""
    parts = field.means, field.log_scales, field.quats, field.opacity_logits, field.sh, field.uncertainty
    return all_finite(*parts) and bool((np.abs(field.quats).max(1, initial=0) > 0).all() if len(field) else True)


def is_splat(splats: Splats) -> bool:
    return is_sound(splats.field) and splats.sh_degree >= 0


def write_fields(folder: Path) -> None:
    """Binary of two degrees, text, of another byte order, with a list and another element."""
    for degree in (0, 1):
        write_field(random_field(9, degree), folder / f"{degree}.ply")
    rows = PlyData.read(str(folder / "0.ply"))["vertex"].data
    PlyData([PlyElement.describe(rows, "vertex")], text=True).write(str(folder / "text.ply"))
    faces = np.array([([0, 1, 2],)], [("vertex_indices", "i4", (3,))])
    parts = [PlyElement.describe(faces, "face"), PlyElement.describe(rows, "vertex")]
    PlyData(parts, byte_order=">").write(str(folder / "big.ply"))


def write_spz_files(folder: Path) -> None:
    """SPZ of versions 2 and 3, without compression: a change of deflated bytes only breaks their checksum."""
    with Spool(folder / "spool") as spool:
        spool.append(random_field(9))
    for version in (2, 3):
        splat_files.write_spz(spool, folder / f"{version}.spz", version)
        data = gzip.decompress((folder / f"{version}.spz").read_bytes())
        (folder / f"{version}.spz").write_bytes(data)
    shutil.rmtree(folder / "spool")


def read_packed(path: Path):
    """An SPZ whose packed content the file has."""
    path.write_bytes(gzip.compress(path.read_bytes(), 1))
    return read_splat(path)


def write_compressed(folder: Path) -> None:
    ends = [f"{end}_{kind}{axis}" for kind in ("", "scale_") for end in ("min", "max") for axis in "xyz"]
    words = np.full(9, 1 << 30 | 77, [(f"packed_{name}", "<u4") for name in ("position", "rotation", "scale", "color")])
    parts = [PlyElement.describe(np.ones(1, [(e, "<f4") for e in ends]), "chunk"), PlyElement.describe(words, "vertex")]
    PlyData(parts, byte_order="<").write(str(folder / "a.ply"))


def write_pictures(folder: Path) -> None:
    """A small picture in every format that photos may have here."""
    pixels = np.arange(24 * 16 * 3, dtype=np.uint8).reshape(16, 24, 3)
    for kind in ("jpg", "png", "tif", "webp", "bmp", "tga", "ppm", "jp2"):
        file = oiio.ImageOutput.create(str(folder / f"a.{kind}"))
        if file and file.open(str(folder / f"a.{kind}"), oiio.ImageSpec(24, 16, 3, oiio.UINT8)):
            file.write_image(pixels)
            file.close()


def read_header(path: Path):
    times = photo_files.read_capture_time(path)
    return photo_files.read_focal_length(path), photo_files.read_gps_position(path), times, image_files.read_size(path)


def is_header(found) -> bool:
    """A finite number, or nothing."""
    focal, place, _, (width, height) = found
    right = place is None or all_finite(place) and abs(place[0]) <= 90 and abs(place[1]) <= 180
    return right and (focal is None or 0 < focal < 100 * max(width, height))


def write_photos(folder: Path) -> None:
    for name in imported_models.SCENE.names:
        image_files.write_png(folder / name, np.zeros((imported_models.HEIGHT, imported_models.WIDTH, 3)))


def read_model(path: Path):
    """A camera model of another program, beside its photos."""
    write_photos(path.parent)
    return importers._read_model(path, PhotoFolder(path.parent))


def is_model(model) -> bool:
    for shot in model.images:
        right = ".." not in shot.name.split("/") and np.abs(shot.rotation @ shot.rotation.T - np.eye(3)).max() < 1e-6
        if not right or shot.lens.width * shot.lens.height > 2e8:
            return False
    return True


def is_finite(value) -> bool:
    """Whether all numbers in nested values are finite."""
    if is_dataclass(value):
        value = vars(value)
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return all(map(is_finite, value))
    return all_finite(value) if isinstance(value, float | int | np.ndarray) else True


def is_camera(camera) -> bool:
    numbers = camera.fx, camera.fy, camera.cx, camera.cy
    shapes = camera.rotation.shape == (3, 3) and camera.translation.shape == (3,)
    whole = all(type(n) is int and n > 0 for n in (camera.width, camera.height))
    return shapes and whole and all_finite(camera.rotation, camera.translation, numbers)


def is_record(shots) -> bool:
    names = all(Path(shot.name).name == shot.name for shot in shots)
    return names and all(is_camera(shot.camera) and is_camera(shot.requested) for shot in shots)


def is_network(facts) -> bool:
    return isinstance(facts, dict) and all(torch.isfinite(v).all() for v in NETWORK.state_dict().values())


READERS = [
    Reader("fields (PLY)", write_fields, read_field, is_sound, 900),
    Reader("fields (compressed PLY)", write_compressed, read_splat, is_splat, 900),
    Reader("fields (SPZ)", write_spz_files, read_packed, is_splat, 20),
    Reader("fields (SPZ, packed)", lambda folder: write_bytes(folder / "a.spz", PACKED), read_splat, is_splat, 20),
    Reader("EXIF", lambda folder: shutil.copy(PHOTO, folder / "a.jpg"), read_header, is_header, 3000),
    Reader(
        "photos",
        write_pictures,
        image_files.read_photo,
        lambda photo: photo.min() >= 0 and photo.max() <= 1,
        100,
    ),
    Reader(
        "weights of the prior",
        lambda folder: write_weights(NETWORK, folder / "a.safetensors"),
        lambda path: weights.load_weights(NETWORK, path),
        is_network,
        350,
    ),
    Reader(
        "nerfstudio",
        lambda folder: write_json(folder / "model.json", imported_models.transforms()),
        read_model,
        is_model,
    ),
    Reader(
        "OpenSfM",
        lambda folder: write_json(folder / "model.json", imported_models.reconstruction()),
        read_model,
        is_model,
    ),
    Reader(
        "capture.json",
        lambda folder: write_capture_record(folder, "render", SHOTS),
        lambda path: read_capture_record(path.parent),
        is_record,
    ),
]


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    """Valid files by the name of their kind."""
    found = {}
    for reader in READERS:
        reader.write(folder := tmp_path_factory.mktemp("valid"))
        found[reader.name] = [(path.name, path.read_bytes()) for path in sorted(folder.iterdir())]
    return found


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
@fuzz
@given(random=randoms)
def test_a_changed_file_is_read_or_refused(valid, tmp_path, reader, random):
    name, data = random.choice(valid[reader.name])
    folder = empty_folder(tmp_path)
    changed = mutate_bytes(random, data, reader.header) if reader.header else mutate_json(random, json.loads(data))
    path = write_bytes(folder / name, changed)

    def check(read):
        assert is_finite(read) and reader.is_right(read)

    read_guarded(reader.name, lambda: reader.read(path), check, path.stat().st_size, name)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle") / "bundle"
    bundles.write_bundle(folder, Ground(discs=4))
    return folder


@fuzz
@given(random=randoms)
def test_chunks_of_bundles(bundle, tmp_path, random):
    """A chunk is changed, and mostly its entry in the manifest with it."""
    manifest = json.loads((bundle / "davgswt.json").read_text())
    folder = empty_folder(tmp_path)
    (folder / "chunks").mkdir()
    entry = manifest["tiles"][0]["chunks"][0]
    data = mutate_bytes(random, (bundle / entry["file"]).read_bytes(), 300)
    if random.random() < 0.8:
        entry["sha256"] = hashlib.sha256(data).hexdigest()
    if random.random() < 0.3:
        entry["bytes"] = len(data)
    if random.random() < 0.3:
        entry["count"] = random.choice((0, 1, 15, 17, 2**40))
    write_bytes(folder / entry["file"], data)
    try:
        read = Bundle(folder, Manifest.from_dict(manifest))
    except InputError as error:  # a number of bytes or Gaussians that no chunk has
        assert "davgswt.json" in str(error)
        return

    def check(chunk):
        field, order = chunk
        assert is_sound(field) and (np.sort(order, 1) == np.arange(len(field))).all()

    read_guarded("chunks", lambda: read.chunk(0, 0), check, len(data), "lod0_tile_00.bin")


@fuzz
@given(random=randoms)
def test_manifests_of_bundles(bundle, tmp_path, random):
    """Whatever a manifest says, a bundle that opens has finite Gaussians in all of its chunks that are read."""
    folder = empty_folder(tmp_path)
    shutil.copytree(bundle / "chunks", folder / "chunks")
    manifest = json.loads((bundle / "davgswt.json").read_text())
    path = write_bytes(folder / "davgswt.json", mutate_json(random, manifest))

    def check_chunk(found):
        assert is_sound(found[0])

    def check(opened):
        assert all_finite(opened.manifest.tile_side, opened.manifest.eye_floor, opened.manifest.encoding.origin)
        for tile in opened.manifest.tiles:
            for level, chunk in enumerate(tile.chunks):
                read = lambda t=tile.tile, lv=level: opened.chunk(t, lv)  # noqa: E731
                read_guarded("chunks by a manifest", read, check_chunk, 10_000, Path(chunk.file).name)

    read_guarded("davgswt.json", lambda: read_bundle(folder), check, path.stat().st_size, "davgswt.json")


@pytest.fixture(scope="module")
def colmap(tmp_path_factory):
    folder = tmp_path_factory.mktemp("colmap")
    imported_models.write_colmap(folder / "text", sees=True)
    pycolmap.Reconstruction(str(folder / "text")).write_binary(str(folder))
    return {
        kind: {name: (where / f"{name}.{kind}").read_bytes() for name in ("cameras", "images", "points3D")}
        for kind, where in (("bin", folder), ("txt", folder / "text"))
    }


@pytest.mark.parametrize("kind", ["bin", "txt"])
@fuzz
@given(random=randoms)
def test_models_of_colmap(colmap, tmp_path, kind, random):
    folder = empty_folder(tmp_path)
    changed = random.choice(("cameras", "images", "points3D"))
    for name, data in colmap[kind].items():
        write_bytes(folder / f"{name}.{kind}", mutate_bytes(random, data, 300) if name == changed else data)
    if random.random() < 0.1:
        (folder / f"points3D.{kind}").unlink()

    def check(model):
        for shot in model.images:
            assert all_finite(shot.rotation, shot.translation) and ".." not in shot.name.split("/")
            assert np.abs(shot.rotation @ shot.rotation.T - np.eye(3)).max() < 1e-6

    size = sum(path.stat().st_size for path in folder.iterdir())
    read_guarded(f"COLMAP ({kind})", lambda: import_colmap(folder), check, size, f".{kind}")


FRAGMENTS = [
    *("scene: &a [*a]", "stop: &a {b: *a}", "scene: !!python/object/apply:os.system [x]", "seeds: 2001-99-99"),
    *("k: !!int x", "k: !!float y", "tau: .nan", "tau: .inf", "k: !!bool z", "? [a]\n: b", "<<: 3", "k: 1e999"),
    *("k: 99999999999999999999", "k: 1:99", "k: 0x", "\t- a", "%YAML 9", "\0", "--- 1\n--- 2", "k: !!timestamp x"),
    *("k: !!binary '*'", "k: !!set 3", "1: 2", "null: 1", "scenes: {3: {}}", "[" * 3000, "scenes: []", "k: 0b_"),
    *("presets: {draft: 7}", "k: " + "9" * 5000, "scenes:\n  x: null", "? {a: b}\n: c"),
]


def mutate_config(random, values: dict, text: str) -> bytes:
    what = random.randrange(4)
    if what == 0:
        return mutate_bytes(random, text.encode(), len(text))
    if what == 1:
        place = text.find("\n", random.randrange(len(text))) + 1
        return (text[:place] + random.choice(FRAGMENTS) + "\n" + text[place:]).encode()
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

    def check(config):
        json.dumps(config, allow_nan=False)
        assert check_config(config) == config

    read = lambda: check_config(add_scene_files(read_config([path]), root / "config/scenes"))  # noqa: E731
    read_guarded("config", read, check, path.stat().st_size, "config")
