"""Localisation: the cameras of further photos, from the pictures and points of a registered scene."""

import logging
import tempfile
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pycolmap
from scipy.spatial import cKDTree

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import ColmapModel, make_lens, read_colmap_model
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

    The photos must be taken with the scene's own camera: each is undistorted as the scene's
    pictures were. Images of the database are numbered from 1: first the scene's pictures, then the
    new photos.
    """
    if not paths:
        return []
    known = read_colmap_model(photos / "sparse")
    pinhole, old = find_main_camera(known.cameras), len(known.names)
    with tempfile.TemporaryDirectory(prefix="locate-") as scratch:
        folder, database = Path(scratch), Path(scratch) / "database.db"
        names = [f"old_{i:05d}.png" for i in range(old)]  # without blanks, as COLMAP's lists require
        for name, copy in zip(progress(known.names, "read pictures"), names, strict=True):
            image_files.write_png(folder / copy, image_files.read_photo(photos / "images" / name))
        numbers: list[int | None] = []
        for path in paths:
            try:
                picture = undistort_scene_photo(image_files.read_photo(path), photos, pinhole)
            except (InputError, ValueError) as error:
                _log.warning("%s: %s", path.name, error)
                numbers.append(None)
                continue
            names.append(f"new_{len(names):05d}.png")
            numbers.append(len(names))
            image_files.write_png(folder / names[-1], picture)
        with closing(pycolmap.Database.open(database)) as store:
            for name, camera in zip(names, [*known.cameras, *[pinhole] * (len(names) - old)], strict=True):
                enter_image(store, name, *enter_camera(store, make_lens(camera)))
        extract_features(folder, database, max(pinhole.width, pinhole.height), FEATURES, 1)
        with closing(pycolmap.Database.open(database)) as store:
            found = [store.read_descriptors(i + 1).data for i in range(len(names))]
        alike = compare_descriptions(describe_photos(found, seed))
        order = np.argsort(-alike[old:, :old], axis=1, kind="stable")[:, :NEIGHBOURS]
        nearest = [(old + j, int(i)) for j, row in enumerate(order) for i in row]
        match_image_pairs([(names[i], names[j]) for j, i in nearest], database, 1, seed)
        with closing(pycolmap.Database.open(database)) as store:
            seen = [_match_features_to_points(i, known, store) for i in range(old)]
            return [_estimate_pose(i, seen, known, pinhole, store, seed) if i else None for i in numbers]


def _match_features_to_points(index: int, known: ColmapModel, store: pycolmap.Database) -> dict[int, int]:
    """Which features of a picture of the scene show which points."""
    own = np.flatnonzero(known.image_of == index)
    places = store.read_keypoints(index + 1)[:, :2].astype(float)
    if not len(own) or not len(places):
        return {}
    far, which = map(np.asarray, cKDTree(known.pixels[own]).query(places))
    return {int(k): int(known.point_of[own[which[k]]]) for k in np.flatnonzero(far <= SAME)}


def _estimate_pose(
    number: int, seen: list[dict[int, int]], known: ColmapModel, pinhole: Camera, store: pycolmap.Database, seed: int
) -> Camera | None:
    """The camera whose view of the matched points fits best, if enough of them agree. number: of the image."""
    at = {}
    for i, points in enumerate(seen, 1):
        if store.exists_two_view_geometry(i, number):
            for a, b in store.read_two_view_geometry(i, number).inlier_matches:
                if int(a) in points:
                    at[int(b), points[int(a)]] = None
    if len(at) < LEAST:
        return None
    rows, columns = (np.array(v) for v in zip(*at, strict=True))
    own = store.read_keypoints(number)[:, :2].astype(float)
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error, options.ransac.random_seed = WORST, seed
    lens = make_lens(pinhole)
    found = pycolmap.estimate_and_refine_absolute_pose(own[rows], known.points[columns], lens, options)
    if not found or found["num_inliers"] < max(LEAST, LEAST_SHARE * len(rows)):
        return None
    pose = found["cam_from_world"].matrix()
    return replace(pinhole, rotation=pose[:, :3].copy(), translation=pose[:, 3].copy())
