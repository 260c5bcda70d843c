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
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.importers import lens_models
from dav_gswt.photos.importers.imported_model import ImportedImage, ImportedModel
from dav_gswt.photos.importers.lens_models import camera_key, shrink_camera, unproject_pixels
from dav_gswt.photos.importers.photo_matching import MatchedPhoto
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_image_pairs
from dav_gswt.photos.sfm.registration import SfmOptions

ALL_PAIRS = 60  # photos up to which each is matched with every other
NEAREST = 20  # photos with which each is matched otherwise
WIDEST = 90.0  # degrees between two viewing directions, beyond which features do not match
SAMPLE = 2000  # points, and a tenth as many shots, sampled to estimate how much is seen


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
    seen, error, out = [], [], []
    for i, place in enumerate(placed):
        shot = given.shots[place.index]
        own = np.flatnonzero(given.image_of == place.index)
        assert shot.lens is not None  # its photo is there, so its size is known
        rays, pixels = unproject_pixels(shot.lens, given.pixels[own]), given.pixels[own]
        known = np.isfinite(rays).all(1)
        own, rays = own[known], rays[known]
        at = given.points[given.point_of[own]] @ shot.rotation.T + shot.translation
        error.append(_errors(shot.lens, at, pixels[known]))
        turned = np.linalg.matrix_power(lens_models.QUARTER, place.turns)[:2, :2]
        out.append(rays @ turned.T)
        seen.append(np.stack([given.point_of[own], np.full(len(own), i)], -1))
    pairs = np.concatenate(seen)
    return Observations(given.points, given.colours, pairs[:, 0], pairs[:, 1], np.concatenate(out), _mean(error))


def triangulate_features(placed: Sequence[MatchedPhoto], options: SfmOptions) -> Observations:
    """Points where rays through matched SIFT features cross; cameras stay as they are.

    The world is moved to the cameras' mean meanwhile: coordinates of a map projection run to millions.
    """
    middle = np.mean([-p.rotation.T @ p.translation for p in placed], axis=0)
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        folder, database = Path(scratch), Path(scratch) / "database.db"
        known = _enter_images(placed, middle, database, options.size)
        names = [known.images[i + 1].name for i in range(len(placed))]
        _write_shrunk_photos(placed, known, folder)
        extract_features(folder, database, options.size, options.features, options.threads)
        pairs = [(names[i], names[j]) for i, j in find_near_pairs(placed)]
        match_image_pairs(pairs, database, options.threads, options.seed)
        choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed)
        choice.triangulation.random_seed = choice.mapper.random_seed = options.seed
        choice.mapper.num_threads = 1
        found = pycolmap.triangulate_points(known, database, folder, folder, options=choice)
        return _read_observations(found, len(placed), middle)


def find_near_pairs(placed: Sequence[MatchedPhoto]) -> list[tuple[int, int]]:
    """Pairs of photos to match, the lower number first: all, or those near each other that look the same way.

    Beyond ALL_PAIRS photos each is paired with the NEAREST ones whose viewing direction differs by less than WIDEST.
    """
    n = len(placed)
    if n <= ALL_PAIRS:
        return [(i, j) for i in range(n) for j in range(i + 1, n)]
    centres = np.array([-p.rotation.T @ p.translation for p in placed])
    forward = np.array([p.rotation[2] for p in placed])
    order = np.asarray(cKDTree(centres).query(centres, min(n, 8 * NEAREST + 1))[1])
    pairs = set()
    for i in range(n):
        alike = [int(j) for j in order[i] if j != i and forward[i] @ forward[j] > np.cos(np.radians(WIDEST))]
        pairs |= {(min(i, j), max(i, j)) for j in alike[:NEAREST]}
    return sorted(pairs)


def measure_visible_share(points: Float[Array, "n 3"], shots: Sequence[ImportedImage]) -> float:
    """Which share of points lies in the pictures of some shot; from a sample spread evenly over both."""
    few = points[:: max(1, len(points) // SAMPLE)]
    known = [(s, s.lens) for s in shots if s.lens is not None]
    inside = np.zeros(len(few), bool)
    for shot, lens in known[:: max(1, len(known) * 10 // SAMPLE)]:
        inside |= find_visible_points(lens, shot.rotation, shot.translation, few)
    return float(inside.mean()) if len(inside) else 0.0


def find_visible_points(
    lens: pycolmap.Camera, rotation: Float[Array, "3 3"], translation: Float[Array, "3"], points: Float[Array, "n 3"]
) -> Bool[Array, "n"]:
    """Which points lie before a camera and within its picture."""
    at = points @ rotation.T + translation
    # A polynomial far outside the picture may lead back into it; a ray 80 degrees off the axis is none of a pinhole's.
    before = at[:, 2] > np.linalg.norm(at, axis=1) * np.cos(np.radians(80))
    pixels = np.full((len(points), 2), -1.0)
    pixels[before] = lens.img_from_cam(at[before])
    return np.asarray((pixels > 0).all(1) & (pixels < [lens.width, lens.height]).all(1))


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


def _write_shrunk_photos(placed: Sequence[MatchedPhoto], known: pycolmap.Reconstruction, folder: Path) -> None:
    """Write what features are looked for in: the photos upright, shrunk by area means."""
    for i in progress(range(len(placed)), "read photos"):
        image = known.images[i + 1]
        camera = known.cameras[image.camera_id]
        photo = image_files.read_photo(placed[i].path)
        image_files.write_png(folder / image.name, image_files.shrink_image(photo, camera.width, camera.height))


def _read_observations(found: pycolmap.Reconstruction, photos: int, middle: Array) -> Observations:
    """Arrays of a reconstruction whose images are numbered from 1 on."""
    ids = np.array(sorted(found.points3D), np.int64)
    points = np.array([found.points3D[i].xyz for i in ids]).reshape(-1, 3)
    colours = (np.array([found.points3D[i].color for i in ids]).reshape(-1, 3) / 255).astype(np.float32)
    seen, out, error = [], [], []
    for i in range(photos):
        image = found.images[i + 1]
        lens = found.cameras[image.camera_id]
        own = np.array([(p.point3D_id, *p.xy) for p in image.get_observation_points2D()], float).reshape(-1, 3)
        place = np.searchsorted(ids, own[:, 0].astype(np.int64))
        pose = image.cam_from_world().matrix()
        error.append(_errors(lens, points[place] @ pose[:, :3].T + pose[:, 3], own[:, 1:]))
        out.append(unproject_pixels(lens, own[:, 1:]))
        seen.append(np.stack([place, np.full(len(own), i)], -1))
    pairs = np.concatenate(seen)
    return Observations(points + middle, colours, pairs[:, 0], pairs[:, 1], np.concatenate(out), _mean(error))


def _errors(lens: pycolmap.Camera, at: Float[Array, "k 3"], pixels: Float[Array, "k 2"]) -> Array:
    """Distances of projections from pixels; NaN behind the camera."""
    seen = np.asarray(lens.img_from_cam(np.ascontiguousarray(at))).reshape(-1, 2)
    return np.linalg.norm(seen - pixels, axis=1)


def _mean(errors: list[Array]) -> float:
    every = np.concatenate(errors)
    every = every[np.isfinite(every)]
    return float(every.mean()) if len(every) else 0.0


def keep_observations(seen: Observations, kept: Bool[Array, "m"]) -> Observations:
    """Some of the observations, and the points that they are of."""
    own = np.unique(seen.point_of[kept])
    return replace(
        seen,
        points=seen.points[own],
        colours=seen.colours[own],
        point_of=np.searchsorted(own, seen.point_of[kept]),
        image_of=seen.image_of[kept],
        rays=seen.rays[kept],
    )
