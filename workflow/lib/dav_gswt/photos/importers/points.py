"""Sparse points for known cameras: the observations of the model, or new ones triangulated from features.

Features and matches may use several threads, triangulation uses one, so that a run repeats to the bit.
"""

import tempfile
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.importers import lens_models
from dav_gswt.photos.importers.checks import ImportedModel
from dav_gswt.photos.importers.lens_models import camera_key, shrink_camera, unproject_pixels
from dav_gswt.photos.importers.photo_matching import MatchedPhoto
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos
from dav_gswt.photos.sfm.registration import NEIGHBOURS, SfmOptions


@dataclass(frozen=True)
class Observations:
    """n points and m observations of them: rays[k] is where photo image_of[k] sees point point_of[k] at depth 1.

    error: mean distance in pixels of the observations from the points' projections.
    """

    points: Float[Array, "n 3"]
    colours: Float32[Array, "n 3"]
    point_of: Int[Array, "m"]
    image_of: Int[Array, "m"]
    rays: Float[Array, "m 2"]
    error: float


def collect_observations(given: ImportedModel, placed: Sequence[MatchedPhoto]) -> Observations:
    """The model's own observations, of those of its images that have a photo."""
    views = []
    for place in placed:
        shot, own = given.shots[place.index], given.image_of == place.index
        assert shot.lens is not None  # its photo is there, so its size is known
        views.append((shot.lens, shot.rotation, shot.translation, given.point_of[own], given.pixels[own]))
    turns = [np.linalg.matrix_power(lens_models.QUARTER, place.turns)[:2, :2] for place in placed]
    return _unproject_views(given.points, given.colours, views, turns)


def _unproject_views(
    points: Float[Array, "n 3"], colours: Float32[Array, "n 3"], views: Sequence[tuple], turns: Sequence[Array]
) -> Observations:
    """Observations as rays. views: of each photo its lens, rotation, translation, and which points
    it sees where.

    turns: rotation of each photo's rays about its axis. Observations that the lens cannot have made
    are left out.
    """
    errors, rays, point_of = [], [], []
    for (lens, rotation, translation, which, pixels), turn in zip(views, turns, strict=True):
        found = unproject_pixels(lens, pixels)
        known = np.isfinite(found).all(1)
        at = points[which[known]] @ rotation.T + translation
        seen = np.asarray(lens.img_from_cam(np.ascontiguousarray(at))).reshape(-1, 2)  # NaN behind the camera
        errors.append(np.linalg.norm(seen - pixels[known], axis=1))
        rays.append(found[known] @ turn.T)
        point_of.append(which[known])
    image_of = np.repeat(np.arange(len(rays)), [len(own) for own in rays])
    every = np.concatenate(errors)
    every = every[np.isfinite(every)]
    error = float(every.mean()) if len(every) else 0.0
    return Observations(points, colours, np.concatenate(point_of), image_of, np.concatenate(rays), error)


def triangulate_features(placed: Sequence[MatchedPhoto], options: SfmOptions) -> Observations:
    """Points where rays through matched SIFT features cross; cameras stay as they are.

    The world is moved to the cameras' mean meanwhile: coordinates of a map projection run to millions.
    """
    middle = np.mean([-p.rotation.T @ p.translation for p in placed], axis=0)
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        folder, database = Path(scratch), Path(scratch) / "database.db"
        known = _enter_images(placed, middle, database, options.size)
        names = [known.images[i + 1].name for i in range(len(placed))]
        for i in progress(range(len(placed)), "read photos"):
            camera = known.cameras[known.images[i + 1].camera_id]
            photo = image_files.read_photo(placed[i].path)
            image_files.write_png(folder / names[i], image_files.shrink_image(photo, camera.width, camera.height))
        extract_features(folder, database, options.size, options.features, options.threads)
        match_photos(len(names), database, NEIGHBOURS, options.threads, options.seed)
        choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed)
        choice.triangulation.random_seed = choice.mapper.random_seed = options.seed
        choice.mapper.num_threads = 1
        found = pycolmap.triangulate_points(known, database, folder, folder, options=choice)
        return _read_observations(found, len(placed), middle)


def _enter_images(placed: Sequence[MatchedPhoto], middle: Array, database: Path, size: int) -> pycolmap.Reconstruction:
    """Cameras and images by numbers from 1 on, the same in a new database and in a reconstruction without points."""
    known, numbers = pycolmap.Reconstruction(), {}
    with closing(pycolmap.Database.open(database)) as store:
        for i, place in enumerate(placed, 1):
            lens = shrink_camera(place.lens, size)
            if (key := camera_key(lens)) not in numbers:
                numbers[key] = enter_camera(store, lens)
                known.add_camera_with_trivial_rig(lens)
            image = enter_image(store, f"{i:06d}.png", *numbers[key])
            pose = np.c_[place.rotation, place.translation + place.rotation @ middle]
            known.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    return known


def _read_observations(found: pycolmap.Reconstruction, photos: int, middle: Array) -> Observations:
    """Observations of a reconstruction whose images are numbered from 1 on."""
    ids = np.array(sorted(found.points3D), np.int64)
    points = np.array([found.points3D[i].xyz for i in ids]).reshape(-1, 3)
    colours = (np.array([found.points3D[i].color for i in ids]).reshape(-1, 3) / 255).astype(np.float32)
    views = []
    for i in range(photos):
        image = found.images[i + 1]
        own = np.array([(p.point3D_id, *p.xy) for p in image.get_observation_points2D()], float).reshape(-1, 3)
        which = np.searchsorted(ids, own[:, 0].astype(np.int64))
        pose = image.cam_from_world().matrix()
        views.append((found.cameras[image.camera_id], pose[:, :3], pose[:, 3], which, own[:, 1:]))
    seen = _unproject_views(points, colours, views, [np.eye(2)] * photos)
    return replace(seen, points=points + middle)
