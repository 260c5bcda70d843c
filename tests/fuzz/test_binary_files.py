"""Binary files, mutated: splats, bundles, camera models, photos' headers, weights."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
import torch
from fixtures import bundles, imported_models
from fixtures.bundles import Ground
from fixtures.fuzzing import (
    all_finite,
    empty_folder,
    fuzz,
    mutate_bytes,
    mutate_json,
    mutate_zip,
    randoms,
    read_guarded,
    write_bytes,
)
from fixtures.random_field import random_field
from hypothesis import given
from plyfile import PlyData, PlyElement
from safetensors.numpy import save
from torch import nn

from dav_gswt.bundle import gswt
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle, read_bundle
from dav_gswt.field import GaussianField, read_field, write_field
from dav_gswt.images import image_files, lpips_weights
from dav_gswt.photos import exif
from dav_gswt.photos.importers import point_ply
from dav_gswt.photos.importers.colmap import import_colmap
from dav_gswt.prior import weights

SCHEMA = Path(__file__).parents[2] / "workflow/schemas/davgswt.schema.json"


def is_sound(field: GaussianField) -> bool:
    """Whether a field is finite and in range."""
    parts = field.means, field.log_scales, field.quats, field.opacity_logits, field.sh, field.uncertainty
    return all_finite(*parts) and bool((np.abs(field.quats).max(1, initial=0) > 0).all() if len(field) else True)


@pytest.fixture(scope="module")
def fields(tmp_path_factory):
    """Files of fields: binary of two degrees, text, of another byte order, with a list and another element."""
    folder = tmp_path_factory.mktemp("fields")
    for degree in (0, 1):
        write_field(random_field(9, degree), folder / f"{degree}.ply")
    rows = PlyData.read(str(folder / "0.ply"))["vertex"].data
    PlyData([PlyElement.describe(rows, "vertex")], text=True).write(str(folder / "text.ply"))
    faces = np.array([([0, 1, 2],)], [("vertex_indices", "i4", (3,))])
    parts = [PlyElement.describe(faces, "face"), PlyElement.describe(rows, "vertex")]
    PlyData(parts, byte_order=">").write(str(folder / "big.ply"))
    return [path.read_bytes() for path in sorted(folder.iterdir())]


@fuzz
@given(random=randoms)
def test_fields(fields, tmp_path, random):
    folder = empty_folder(tmp_path)
    path = write_bytes(folder / "a.ply", mutate_bytes(random, random.choice(fields), 900))

    def check(field):
        assert is_sound(field)
        write_field(field, folder / "b.ply")
        assert np.array_equal(read_field(folder / "b.ply").means, field.means)

    read_guarded("fields (PLY)", lambda: read_field(path), check, path.stat().st_size, "a.ply", folder=folder)


@pytest.fixture(scope="module")
def clouds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clouds")
    kinds = [*((axis, "f8") for axis in "xyz"), *((colour, "u1") for colour in ("red", "green", "blue"))]
    rows = np.zeros(20, kinds)
    for k, axis in enumerate("xyz"):
        rows[axis] = np.arange(20) * 0.1 + k
    rows["green"] = 200
    for text in (False, True):
        PlyData([PlyElement.describe(rows, "vertex")], text=text).write(str(folder / f"{text}.ply"))
    return [path.read_bytes() for path in sorted(folder.iterdir())]


@fuzz
@given(random=randoms)
def test_clouds_of_points(clouds, tmp_path, random):
    folder = empty_folder(tmp_path)
    path = write_bytes(folder / "a.ply", mutate_bytes(random, random.choice(clouds), 300))

    def check(read):
        places, colours = read
        assert all_finite(places, colours) and colours.min(initial=0) >= 0 and colours.max(initial=1) <= 1

    read_guarded("point clouds (PLY)", lambda: point_ply.read_point_ply(path), check, path.stat().st_size, "a.ply")


@fuzz
@given(random=randoms)
def test_sets_of_the_public_renderer(set_of_tiles, tmp_path, random):
    folder = empty_folder(tmp_path)
    path = write_bytes(folder / "gswt.zip", mutate_zip(random, set_of_tiles))

    def check(read):
        assert all(is_sound(field) for level in read for field in level) and len(read[0]) % 16 == 0
        gswt.write_gswt(read, 3.0, folder / "again.zip")

    size = path.stat().st_size
    read_guarded("gswt.zip", lambda: gswt.read_gswt(path, 3.0), check, size, "gswt.zip", folder=folder)


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
    read = Bundle(folder, Manifest.from_dict(manifest))

    def check(chunk):
        field, order = chunk
        assert is_sound(field) and (np.sort(order, 1) == np.arange(len(field))).all()

    read_guarded("chunks", lambda: read.chunk(0, 0), check, len(data), "lod0_tile_00.bin", folder=folder)


@fuzz
@given(random=randoms)
def test_manifests_of_bundles(bundle, tmp_path, random):
    """Whatever a manifest says, a bundle that opens has finite Gaussians in all of its chunks that are read."""
    folder = empty_folder(tmp_path)
    shutil.copytree(bundle / "chunks", folder / "chunks")
    manifest = json.loads((bundle / "davgswt.json").read_text())
    path = write_bytes(folder / "davgswt.json", mutate_json(random, manifest))

    def check(opened):
        assert all_finite(opened.manifest.tile_side, opened.manifest.eye_floor, opened.manifest.encoding.origin)
        for tile in opened.manifest.tiles:
            for level in range(len(tile.chunks)):
                chunk = bundle / tile.chunks[level].file
                read_guarded(
                    "chunks by a manifest",
                    lambda t=tile.tile, lv=level: opened.chunk(t, lv),
                    lambda found: is_sound(found[0]) or pytest.fail("not finite"),
                    10_000,
                    chunk.name,
                )

    read_guarded("davgswt.json", lambda: read_bundle(folder, SCHEMA), check, path.stat().st_size, "davgswt.json")


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
        assert all_finite(model.points, model.colours, model.pixels)
        for shot in model.shots:
            assert all_finite(shot.rotation, shot.translation) and ".." not in shot.name.split("/")
            assert np.abs(shot.rotation @ shot.rotation.T - np.eye(3)).max() < 1e-6
        assert len(model.point_of) == len(model.image_of) == len(model.pixels)
        assert model.point_of.max(initial=-1) < len(model.points)

    size = sum(path.stat().st_size for path in folder.iterdir())
    read_guarded(f"COLMAP ({kind})", lambda: import_colmap(folder, folder), check, size, f".{kind}", folder=folder)


@fuzz
@given(random=randoms)
def test_headers_of_photos(root, tmp_path, random):
    """EXIF: a finite number, or nothing; a file that is no picture is refused."""
    photo = (root / "resources/photos/brighton_beach/images/DJI_0018.jpg").read_bytes()
    folder = empty_folder(tmp_path)
    path = write_bytes(folder / "a.jpg", mutate_bytes(random, photo, random.choice((30, 700, 3000))))

    def read():
        return (
            exif.read_focal_length(path),
            exif.read_gps_position(path),
            exif.read_capture_time(path),
            image_files.read_size(path),
        )

    def check(found):
        focal, place, _, (width, height) = found
        assert focal is None or 0 < focal < 100 * max(width, height)
        assert place is None or all_finite(place) and abs(place[0]) <= 90 and abs(place[1]) <= 180

    read_guarded("EXIF", read, check, path.stat().st_size, "a.jpg")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """A small picture in every format that photos may have here."""
    folder, pixels = tmp_path_factory.mktemp("pictures"), np.arange(24 * 16 * 3, dtype=np.uint8).reshape(16, 24, 3)
    for kind in ("jpg", "png", "tif", "webp", "bmp", "tga", "ppm", "jp2"):
        file = oiio.ImageOutput.create(str(folder / f"a.{kind}"))
        if file and file.open(str(folder / f"a.{kind}"), oiio.ImageSpec(24, 16, 3, oiio.UINT8)):
            file.write_image(pixels)
            file.close()
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@fuzz
@given(random=randoms)
def test_pixels_of_photos(pictures, tmp_path, random):
    name, data = random.choice(list(pictures.items()))
    path = write_bytes(empty_folder(tmp_path) / name, mutate_bytes(random, data, random.choice((30, 100, 400))))

    def check(photo):
        assert all_finite(photo) and photo.min() >= 0 and photo.max() <= 1

    read_guarded("photos", lambda: image_files.read_photo(path), check, path.stat().st_size, name)


@fuzz
@given(random=randoms)
def test_weights_of_the_prior(tmp_path, random):
    torch.manual_seed(0)
    network = nn.Sequential(nn.Linear(3, 4), nn.Linear(4, 2))
    folder = empty_folder(tmp_path)
    weights.save_weights(network, folder / "whole.safetensors", {"what": "a test"})
    path = write_bytes(folder / "a.safetensors", mutate_bytes(random, (folder / "whole.safetensors").read_bytes(), 350))

    def check(facts):
        assert isinstance(facts, dict) and all(torch.isfinite(v).all() for v in network.state_dict().values())

    size = path.stat().st_size
    read_guarded("weights of the prior", lambda: weights.load_weights(network, path), check, size, "a.safetensors")


@pytest.fixture(scope="module")
def small_kernels():
    """LPIPS's shapes, made small."""
    before = lpips_weights.KERNELS
    lpips_weights.KERNELS = ((2, 3, 1, 1), (3, 2, 1, 1), (2, 3, 1, 1), (2, 2, 1, 1), (1, 2, 1, 1))
    yield lpips_weights.KERNELS
    lpips_weights.KERNELS = before


@fuzz
@given(random=randoms)
def test_weights_of_lpips(small_kernels, tmp_path, random):
    arrays = {f"kernel{i}": np.ones(shape, np.float32) for i, shape in enumerate(small_kernels)}
    arrays |= {f"{k}{i}": np.ones(s[:1], np.float32) for k in ("bias", "head") for i, s in enumerate(small_kernels)}
    path = write_bytes(empty_folder(tmp_path) / "a.safetensors", mutate_bytes(random, save(arrays), 1200))

    def check(read):
        assert all_finite(*read.kernels[0], *read.biases)

    size = path.stat().st_size
    read_guarded("weights of LPIPS", lambda: lpips_weights.read(path, published=False), check, size, "a.safetensors")
