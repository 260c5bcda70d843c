"""A synthetic scene as photos: start and test views rendered, and points triangulated from their exact poses."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pycolmap

from dav_gswt import images
from dav_gswt.cameras import Camera
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.photos import model, synthetic
from dav_gswt.photos.model import Model

FEATURES = 4096


def render_set(entry: dict, folder: Path) -> None:
    """Fill a photos/ folder: images/, sparse/ (exact cameras, triangulated points), ground.json with the test groups.

    entry: a synthetic scene of the config. Points come from the start views alone; test views are in the model, but
    observe nothing.
    """
    scene = synthetic.of_config(entry)
    start, test = synthetic.start_views(entry), synthetic.test_views(entry)
    shots = [(f"view_{i:02d}.png", c) for i, c in enumerate(start)]
    tests = [(f"test_{i:02d}.png", c) for i, c in enumerate(test)]
    (folder / "images").mkdir(parents=True, exist_ok=True)
    (folder / "sparse").mkdir(parents=True, exist_ok=True)
    for name, camera in progress(shots + tests, "render photos"):
        images.write(folder / "images" / name, synthetic.render(scene, camera))
    found = triangulated(folder / "images", shots, entry["seed"])
    model.write(with_cameras(found, tests), folder / "sparse")
    named = [name for name, _ in tests]
    groups = {group: [named[i] for i in part] for group, part in synthetic.test_groups(entry).items()}
    frame = scene.frame | {"test": named, "test_groups": groups, "images": len(shots), "registered": len(shots)}
    write_json(folder / "ground.json", frame | {"left_out": [], "focal_ratio": None})


def triangulated(folder: Path, shots: list[tuple[str, Camera]], seed: int) -> Model:
    """Points where matched SIFT features of pictures with known cameras cross; cameras stay as they are."""
    names, cameras = (list(column) for column in zip(*shots, strict=True))
    none = np.zeros(0, int)
    known = Model(
        tuple(names), tuple(cameras), np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))
    )
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = FEATURES
    matching = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    reader = pycolmap.ImageReaderOptions(camera_model="PINHOLE")
    reader.camera_params = ",".join(str(v) for v in (cameras[0].fx, cameras[0].fy, cameras[0].cx, cameras[0].cy))
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        database, sparse = Path(scratch) / "database.db", Path(scratch) / "sparse"
        sparse.mkdir()
        pycolmap.extract_features(
            database,
            folder,
            image_names=names,
            camera_mode=pycolmap.CameraMode.SINGLE,
            reader_options=reader,
            extraction_options=extraction,
            device=pycolmap.Device.cpu,
        )
        pycolmap.match_exhaustive(database, matching, verification_options=verification, device=pycolmap.Device.cpu)
        model.write(known, sparse)
        options = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=seed)
        stored = pycolmap.triangulate_points(
            pycolmap.Reconstruction(str(sparse)), database, folder, sparse, options=options
        )
        return model.of(stored)


def with_cameras(found: Model, more: list[tuple[str, Camera]]) -> Model:
    """The model with further images that observe nothing, ordered by name as a model's images are."""
    named = sorted([*zip(found.names, found.cameras, strict=True), *more], key=lambda pair: pair[0])
    names = tuple(name for name, _ in named)
    moved = np.array([names.index(name) for name in found.names])
    image_of = moved[found.image_of]
    order = np.lexsort((image_of, found.point_of))
    return replace(
        found,
        names=names,
        cameras=tuple(camera for _, camera in named),
        point_of=found.point_of[order],
        image_of=image_of[order],
        pixels=found.pixels[order],
    )
