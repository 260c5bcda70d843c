"""The photo set of a synthetic scene: start and test views, and points triangulated with their exact poses."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import (
    ColmapModel,
    make_reconstruction,
    model_from_reconstruction,
    write_colmap_model,
)
from dav_gswt.photos.sfm.registration import SfmOptions, triangulate_features
from dav_gswt.photos.synthetic import mitsuba_scene
from dav_gswt.photos.synthetic import scene as synthetic

FEATURES = 4096
NEIGHBOURS = 20  # views that each is matched with, if there are many


def render_set(entry: dict, folder: Path, views: Sequence[Camera], groups: Mapping[str, Sequence[Camera]]) -> None:
    """Fill a photos/ folder: images/, sparse/ (exact cameras, triangulated points), ground.json.

    entry: a synthetic scene of the config. views: of the start photos, the only ones that points come from. groups: of
    the test photos; they are in the model, but observe nothing.
    """
    scene, shots = synthetic.scene_from_config(entry), _name_views("view", views)
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


def _name_views(kind: str, views: Sequence[Camera]) -> list[tuple[str, Camera]]:
    """The views with names that sort by number."""
    digits = max(2, len(str(len(views) - 1)))
    return [(f"{kind}_{i:0{digits}d}.png", camera) for i, camera in enumerate(views)]


def triangulate_points(folder: Path, shots: list[tuple[str, Camera]], seed: int) -> ColmapModel:
    """Triangulate points of matched SIFT features of pictures with known cameras, which are not changed."""
    names, cameras = zip(*shots, strict=True)
    none = np.zeros(0, int)
    empty = ColmapModel(names, cameras, np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2)))
    known = make_reconstruction(empty)
    for lens in known.cameras.values():
        lens.has_prior_focal_length = True
    options = SfmOptions(size=max(cameras[0].width, cameras[0].height), features=FEATURES, seed=seed)
    return model_from_reconstruction(triangulate_features(known, folder, NEIGHBOURS, options))


def add_cameras(found: ColmapModel, tests: list[tuple[str, Camera]]) -> ColmapModel:
    """The model with further images without observations, whose names come first."""
    names, cameras = zip(*tests, strict=True) if tests else ((), ())
    return replace(
        found,
        names=(*names, *found.names),
        cameras=(*cameras, *found.cameras),
        image_of=found.image_of + len(tests),
    )
