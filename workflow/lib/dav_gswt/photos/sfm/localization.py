"""Localisation: the cameras of further photos, from the pictures and points of a registered scene."""

import logging
import tempfile
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.photos.lenses import find_main_camera, undistort_scene_photo
from dav_gswt.photos.sfm.features import (
    compare_descriptions,
    describe_photos,
    enter_camera,
    enter_image,
    extract_features,
    match_image_pairs,
)

_log = logging.getLogger(__name__)

FEATURES = 4096
NEIGHBOURS = 8  # pictures of the scene that a new photo is matched with
SAME = 2.0  # pixels between a feature of a picture and the point seen there, within which they are one
LEAST = 20  # points that fix a photo's place
LEAST_SHARE = 0.25  # of its matched points that must agree on it
WORST = 6.0  # pixels, of a point that agrees


def localize_photos(photos: Path, paths: list[Path], seed: int = 0) -> list[Camera | None]:
    """The cameras of photos in the world of a photos/ folder; None for one that finds no place.

    The photos must be taken with the scene's own camera: each is undistorted as its pictures were.
    """
    if not paths:
        return []
    known = read_colmap_model(photos / "sparse")
    with tempfile.TemporaryDirectory(prefix="locate-") as scratch:
        return _localize_photos(known, photos, paths, Path(scratch), seed)


def _localize_photos(
    known: ColmapModel, photos: Path, paths: list[Path], scratch: Path, seed: int
) -> list[Camera | None]:
    pinhole = find_main_camera(known.cameras)
    new = [_write_undistorted(path, photos, pinhole, scratch / f"new_{i:04d}.png") for i, path in enumerate(paths)]
    old = [f"old_{i:05d}.png" for i in range(len(known.names))]  # without blanks, as COLMAP's lists want them
    for name, copy in zip(progress(known.names, "read pictures"), old, strict=True):
        image_files.write_png(scratch / copy, image_files.read_photo(photos / "images" / name))
    database = scratch / "database.db"
    names = old + [name for name in new if name]
    size = max(pinhole.width, pinhole.height)
    with closing(pycolmap.Database.open(database)) as store:
        _enter_images(names, [*known.cameras, *[pinhole] * (len(names) - len(known.names))], store)
    extract_features(scratch, database, size, FEATURES, 1)
    _match_photos(names, len(known.names), database, seed)
    with closing(pycolmap.Database.open(database)) as store:
        seen = _match_features_to_points(known, store)
        return [_estimate_pose(names.index(name), seen, known, pinhole, store, seed) if name else None for name in new]


def _write_undistorted(path: Path, photos: Path, pinhole: Camera, out: Path) -> str | None:
    """Write the photo as a picture of the scene's; None, with the reason in the log, where it is not of its camera."""
    try:
        image_files.write_png(out, undistort_scene_photo(image_files.read_photo(path), photos, pinhole))
    except (InputError, ValueError) as error:
        _log.warning("%s: %s", path.name, error)
        return None
    return out.name


def _enter_images(names: list[str], cameras: list[Camera], store: pycolmap.Database) -> None:
    """Images numbered from 1 in the order of their names' list, each with a pinhole of its own."""
    for name, camera in zip(names, cameras, strict=True):
        params = [camera.fx, camera.fy, camera.cx, camera.cy]
        lens = pycolmap.Camera(model="PINHOLE", width=camera.width, height=camera.height, params=params)
        enter_image(store, name, *enter_camera(store, lens))


def _match_photos(names: list[str], old: int, database: Path, seed: int) -> None:
    """Match every new photo with the pictures that it looks like most."""
    with closing(pycolmap.Database.open(database)) as store:
        found = [store.read_descriptors(i + 1).data for i in range(len(names))]
    alike = compare_descriptions(describe_photos(found, seed))
    some = [
        (j, int(i)) for j in range(old, len(names)) for i in np.argsort(-alike[j, :old], kind="stable")[:NEIGHBOURS]
    ]
    match_image_pairs([(names[i], names[j]) for j, i in some], database, 1, seed)


def _match_features_to_points(known: ColmapModel, store: pycolmap.Database) -> list[dict[int, int]]:
    """Per picture of the scene: which of its features shows which point."""
    out = []
    for i in range(len(known.names)):
        own = np.flatnonzero(known.image_of == i)
        places = _read_keypoints(store, i)
        if not len(own) or not len(places):
            out.append({})
            continue
        far, which = map(np.asarray, cKDTree(known.pixels[own]).query(places))
        out.append({int(k): int(known.point_of[own[which[k]]]) for k in np.flatnonzero(far <= SAME)})
    return out


def _read_keypoints(store: pycolmap.Database, index: int) -> Float[Array, "n 2"]:
    return store.read_keypoints(index + 1)[:, :2].astype(float)


def _estimate_pose(
    index: int, seen: list[dict[int, int]], known: ColmapModel, pinhole: Camera, store: pycolmap.Database, seed: int
) -> Camera | None:
    """The camera whose view of the matched points fits best, if enough of them agree."""
    own, at = _read_keypoints(store, index), {}
    for i, points in enumerate(seen):
        if not store.exists_two_view_geometry(i + 1, index + 1):
            continue
        for a, b in store.read_two_view_geometry(i + 1, index + 1).inlier_matches:
            if int(a) in points:
                at[int(b), points[int(a)]] = None
    if len(at) < LEAST:
        return None
    rows, columns = (np.array(v) for v in zip(*at, strict=True))
    params = [pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy]
    lens = pycolmap.Camera(model="PINHOLE", width=pinhole.width, height=pinhole.height, params=params)
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error, options.ransac.random_seed = WORST, seed
    found = pycolmap.estimate_and_refine_absolute_pose(own[rows], known.points[columns], lens, options)
    if not found or found["num_inliers"] < max(LEAST, LEAST_SHARE * len(rows)):
        return None
    pose = found["cam_from_world"].matrix()
    return replace(pinhole, rotation=pose[:, :3].copy(), translation=pose[:, 3].copy())
