"""The photo set of a synthetic scene: start and test views, and points triangulated with their exact poses."""

import tempfile
from contextlib import closing
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pycolmap

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import ColmapModel, make_lens, model_from_reconstruction, write_colmap_model
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos
from dav_gswt.photos.synthetic import mitsuba_scene
from dav_gswt.photos.synthetic import scene as synthetic

FEATURES = 4096
NEIGHBOURS = 20  # views that each is matched with, if there are many


def render_set(entry: dict, folder: Path) -> None:
    """Fill a photos/ folder: images/, sparse/ (exact cameras, triangulated points), ground.json.

    entry: a synthetic scene of the config. Points come from the start views alone; test views are in the model, but
    observe nothing.
    """
    scene, groups = synthetic.scene_from_config(entry), synthetic.test_views(entry)
    shots = _name_views("view", synthetic.start_views(entry))
    tests = _name_views("test", [camera for cameras in groups.values() for camera in cameras])
    for part in ("images", "sparse"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    for name, camera in progress(shots + tests, "render photos"):
        image_files.write_png(folder / "images" / name, synthetic.render(scene, camera))
    points = triangulate_points(folder / "images", shots, entry["seed"])
    write_colmap_model(add_cameras(points, tests), folder / "sparse")
    named = iter(name for name, _ in tests)
    frame = replace(
        scene.frame,
        test=tuple(name for name, _ in tests),
        test_groups={group: tuple(islice(named, len(cameras))) for group, cameras in groups.items()},
        images=len(shots),
        registered=len(shots),
        renderer=mitsuba_scene.describe_renderer(),
    )
    write_scene_frame(folder / "ground.json", frame)


def _name_views(kind: str, views: list[Camera]) -> list[tuple[str, Camera]]:
    """The views with names that sort by number."""
    digits = max(2, len(str(len(views) - 1)))
    return [(f"{kind}_{i:0{digits}d}.png", camera) for i, camera in enumerate(views)]


def triangulate_points(folder: Path, shots: list[tuple[str, Camera]], seed: int) -> ColmapModel:
    """Triangulate points of matched SIFT features of pictures with known cameras, which are not changed."""
    names, cameras = (list(column) for column in zip(*shots, strict=True))
    none = np.zeros(0, int)
    known = ColmapModel(
        tuple(names), tuple(cameras), np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))
    )
    first = cameras[0]
    lens = make_lens(first)
    lens.has_prior_focal_length = True
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        database, sparse = Path(scratch) / "database.db", Path(scratch) / "sparse"
        sparse.mkdir()
        with closing(pycolmap.Database.open(database)) as store:
            numbers = enter_camera(store, lens)
            for name in names:
                enter_image(store, name, *numbers)
        extract_features(folder, database, max(first.width, first.height), FEATURES, 1)
        match_photos(len(names), database, NEIGHBOURS, 1, seed)
        write_colmap_model(known, sparse)
        options = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=seed)
        stored = pycolmap.triangulate_points(
            pycolmap.Reconstruction(str(sparse)), database, folder, sparse, options=options
        )
        return model_from_reconstruction(stored)


def add_cameras(found: ColmapModel, more: list[tuple[str, Camera]]) -> ColmapModel:
    """The model with further images without observations; images are ordered by name."""
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
