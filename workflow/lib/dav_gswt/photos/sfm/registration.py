"""Structure from motion: a folder of overlapping photos becomes cameras, sparse points and undistorted pictures.

pycolmap does it on the CPU: SIFT features, matches of photos that look alike, incremental or global mapping. Features
and matches may use several threads, since each photo and each pair stands alone and its random numbers start from the
seed; mapping uses one. So a run repeats to the bit.
"""

import logging
import tempfile
from collections import Counter, defaultdict
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos import exif
from dav_gswt.photos.colmap_model import ColmapModel, bundle_adjust, measure_parallax, model_from_reconstruction
from dav_gswt.photos.exif import read_focal_length
from dav_gswt.photos.lenses import undistort_photo
from dav_gswt.photos.sfm.features import extract_features, match_photos, run_with_progress
from dav_gswt.photos.sfm.focal_length import require_parallax, settle_focal_length
from dav_gswt.photos.sfm.gps import GpsPositions, align_to_gps, read_gps_positions

_log = logging.getLogger(__name__)

LEAST_PHOTOS = 3
GUESS = 1.2  # focal length in longer sides, where EXIF has none; then it is refined
PRESETS = {
    "quick": {"features": 4096, "neighbours": 12},
    "careful": {"features": 8192, "neighbours": 40, "size": 2048},
}


@dataclass(frozen=True)
class SfmOptions:
    """How structure from motion is run.

    size: longer side at which features are looked for, pixels. features: most of them in a photo. neighbours: photos
    that each is matched with, 0 for all. mapper: incremental (one photo after the other) or global (all at once).
    cameras: auto (one for all photos of equal size and EXIF focal length), one (for all of equal size), or each (photo
    its own). focal: 35 mm equivalent where EXIF has none or is wrong. side: longer side of the undistorted pictures,
    pixels (photos are never enlarged). threads: for features and matches; changes no result.
    """

    size: int = 1024
    features: int = 4096
    neighbours: int = 12
    mapper: str = "incremental"
    cameras: str = "auto"
    focal: float | None = None
    side: int = 1024
    threads: int = 1
    seed: int = 0


def choose_sfm_options(scene: dict, threads: int) -> SfmOptions:
    """The options that a scene's entry of the config asks for."""
    given: dict[str, Any] = {"size": 1024} | PRESETS[scene.get("sfm", "quick")]
    given |= {key: scene[key] for key in ("mapper", "cameras", "focal") if key in scene}
    given["size"] = min(given["size"], max(1024, scene["size"]))
    return SfmOptions(**given, side=scene["size"], threads=threads)


@dataclass(frozen=True)
class Registration:
    """Photos that found their place. model: of the undistorted pictures, in an arbitrary world frame; in metres east,
    north and up of `positions` where the photos have any.

    sources, lenses: of each of the model's images the photo and its distorted camera at the size of the picture.
    left_out: names and reasons. focal: how the focal length was settled; None where the model was given. error: mean
    reprojection error at the size at which features were looked for, pixels.
    """

    model: ColmapModel
    sources: tuple[Path, ...]
    lenses: tuple[pycolmap.Camera, ...]
    left_out: tuple[tuple[str, str], ...]
    focal: FocalLength | None
    error: float
    positions: GpsPositions | None = None

    @property
    def focal_ratio(self) -> float | None:
        """Final focal length over EXIF's; None where EXIF has none."""
        return self.focal.ratio if self.focal else None


@dataclass(frozen=True)
class _Photo:
    path: Path
    key: str  # name of the picture that is made of it
    width: int  # at the size at which features are looked for
    height: int
    focal: float | None  # EXIF's, at that size


def register_photos(folder: Path | str, options: SfmOptions) -> Registration:
    """Register the photos that lie in a folder.

    One radial distortion term a camera. Where EXIF has a focal length it is held, unless the photos fix it (see
    `focal`). GPS positions give metres and north, where the photos have them and agree (see `gps`).
    Raises: InputError: no folder or no photos, fewer than three, one that cannot be read, they do not overlap, or a
    solution that is degenerate, with the reason.
    """
    paths = image_files.list_photos(folder)
    if len(paths) < LEAST_PHOTOS:
        names = " and ".join(p.name for p in paths)
        raise InputError(f"{folder}: only {names}; at least {LEAST_PHOTOS} overlapping photos are needed, better 20")
    photos = [_described(p, key, options) for p, key in zip(paths, _keys(paths), strict=True)]
    positions = read_gps_positions(paths)
    with tempfile.TemporaryDirectory(prefix="sfm-") as scratch:
        database = Path(scratch) / "database.db"
        _shrink(photos, Path(scratch))
        with closing(pycolmap.Database.open(database)) as store:
            held = _enter(photos, store, options)
        extract_features(len(photos), Path(scratch), database, options.size, options.features, options.threads)
        match_photos(len(photos), database, options.neighbours, options.threads, options.seed)
        found = _map(len(photos), held, database, Path(scratch), options)
        best = max(found.values(), key=lambda r: (r.num_reg_images(), r.num_points3D()), default=None)
        left_out = _left_out(photos, best, database)
    placed = len(photos) - len(left_out)
    if best is None or placed < LEAST_PHOTOS:
        raise InputError(
            f"{folder}: {placed} of {len(photos)} photos could be placed relative to each other; they must overlap by "
            "more than half and show texture: take more from closer positions, or remove what shows something else"
        )
    for name, reason in left_out:
        _log.warning("%s is left out: %s", name, reason)
    settled = settle_focal_length(best, held, np.random.default_rng(options.seed))
    _log.info("focal length: %s", settled.decision)
    if positions and not align_to_gps(best, {p.key: at for p, at in zip(photos, positions.at, strict=True)}):
        positions = None
    made = _undistortable(photos, best, left_out, settled, options, positions)
    require_parallax(measure_parallax(made.model))
    return made


def undistort_image(registered: Registration, index: int) -> Float32[Array, "h w 3"]:
    """The picture of the model's image `index`: the photo as a pinhole camera would have taken it.

    The photo is shrunk by area means to the picture's resolution, then sampled (`undistort_photo`).
    """
    lens, camera = registered.lenses[index], registered.model.cameras[index]
    photo = image_files.shrink_image(image_files.read_photo(registered.sources[index]), lens.width, lens.height)
    return undistort_photo(photo, lens, camera)


def _keys(paths: list[Path]) -> list[str]:
    """Names of the pictures made of photos: the stem, with the old suffix where two would be equal."""
    stems = Counter(p.stem for p in paths)
    return [f"{p.stem}.png" if stems[p.stem] == 1 else f"{p.stem}_{p.suffix[1:]}.png" for p in paths]


def _fit(width: int, height: int, longest: int) -> tuple[int, int]:
    share = min(1.0, longest / max(width, height))
    return max(1, round(width * share)), max(1, round(height * share))


def _described(path: Path, key: str, options: SfmOptions) -> _Photo:
    full = image_files.read_size(path)
    width, height = _fit(*full, options.size)
    given = options.focal and options.focal / exif.FILM_DIAGONAL * float(np.hypot(*full))
    pixels = given or read_focal_length(path)
    return _Photo(path, key, width, height, pixels and pixels * width / full[0])


def _enter(photos: list[_Photo], store: pycolmap.Database, options: SfmOptions) -> dict[int, float]:
    """Enter cameras and images, numbered in the photos' order; returns EXIF's focal length of those that have one."""
    cameras, held = {}, {}
    for i, photo in enumerate(photos):
        lens = {"auto": (photo.width, photo.height, photo.focal), "one": (photo.width, photo.height), "each": i}
        lens = lens[options.cameras]
        if lens not in cameras:
            focal = photo.focal or GUESS * max(photo.width, photo.height)
            camera = pycolmap.Camera.create_from_model_name(1, "SIMPLE_RADIAL", focal, photo.width, photo.height)
            camera.has_prior_focal_length = photo.focal is not None
            rig = pycolmap.Rig()
            camera.camera_id = store.write_camera(camera)
            rig.add_ref_sensor(camera.sensor_id)
            cameras[lens] = camera.camera_id, store.write_rig(rig)
            if photo.focal:
                held[camera.camera_id] = photo.focal
        image = pycolmap.Image(name=photo.key, camera_id=cameras[lens][0])
        image.image_id = store.write_image(image)
        frame = pycolmap.Frame(rig_id=cameras[lens][1])
        frame.add_data_id(image.data_id)
        store.write_frame(frame)
    return held


def _shrink(photos: list[_Photo], folder: Path) -> None:
    """Write what features are looked for in: the photos shrunk by area means, grey by Rec. 601."""
    for photo in progress(photos, "read photos"):
        image = image_files.shrink_image(image_files.read_photo(photo.path), photo.width, photo.height)
        grey = image @ np.array([0.299, 0.587, 0.114], np.float32)
        image_files.write_png(folder / photo.key, np.repeat(grey[..., None], 3, axis=2))


def _map(
    count: int, held: dict[int, float], database: Path, scratch: Path, options: SfmOptions
) -> dict[int, pycolmap.Reconstruction]:
    """Mapping; where only some cameras have a known focal length, those stay as they are until the end."""
    with closing(pycolmap.Database.open(database)) as store:
        mixed = 0 < len(held) < store.num_cameras()
    if options.mapper == "global":
        return _map_globally(bool(held), database, scratch, options)
    choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed, max_num_models=3)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = choice.triangulation.random_seed = options.seed
    if held and not mixed:
        choice.ba_refine_focal_length = choice.mapper.abs_pose_refine_focal_length = False
    if mixed:
        choice.constant_cameras = set(held)
    placed = []
    found = run_with_progress(
        lambda token: pycolmap.incremental_mapping(
            database,
            scratch,
            scratch,
            choice,
            next_image_callback=lambda: placed.append(1),
            cancellation_token=token,
        ),
        lambda: min(len(placed), count),
        count,
        "place photos",
    )
    if mixed:
        for reconstruction in found.values():
            bundle_adjust(reconstruction, refine_focal_length=False)
    return found


def _map_globally(
    known: bool, database: Path, scratch: Path, options: SfmOptions
) -> dict[int, pycolmap.Reconstruction]:
    """All photos at once. known: EXIF has focal lengths."""
    choice = pycolmap.GlobalPipelineOptions(num_threads=1, random_seed=options.seed)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = options.seed
    for part in (choice.mapper.rotation_averaging, choice.mapper.global_positioning):
        part.random_seed = options.seed
    choice.mapper.global_positioning.use_gpu = False
    adjustment = choice.mapper.bundle_adjustment
    adjustment.refine_focal_length = not known
    adjustment.ceres.use_gpu = False
    adjustment.ceres.solver_options.num_threads = 1
    return pycolmap.global_mapping(database, scratch, scratch, choice)


def _left_out(photos: list[_Photo], best: pycolmap.Reconstruction | None, database: Path) -> tuple:
    """Names of the photos that found no place, with the reason."""
    placed = set(best.reg_image_ids()) if best else set()
    most = defaultdict(int)  # points that a photo shares with one that has a place
    with closing(pycolmap.Database.open(database)) as store:
        for pair, inliers in zip(*store.read_two_view_geometry_num_inliers(), strict=True):
            one, two = pycolmap.pair_id_to_image_pair(pair)
            for number, other in ((one, two), (two, one)):
                if other in placed:
                    most[number] = max(most[number], inliers)
    out = []
    for number, photo in enumerate(photos, 1):
        if number not in placed:
            unsure = f"it shares {most[number]} points with a placed photo, but its position stays unsure"
            out.append((photo.path.name, unsure if most[number] else "it matches no photo that could be placed"))
    return tuple(out)


def _undistortable(
    photos: list[_Photo],
    best: pycolmap.Reconstruction,
    left_out: tuple,
    settled: FocalLength,
    options: SfmOptions,
    positions: GpsPositions | None,
) -> Registration:
    """Bring cameras to the size of the pictures, and give each its pinhole."""
    by_key = {photo.key: photo for photo in photos}
    found, pinholes = {}, {}
    limits = pycolmap.UndistortCameraOptions(blank_pixels=0, max_image_size=options.side)
    for i in best.reg_image_ids():
        image = best.images[i]
        number = image.camera_id
        if number not in found:
            lens = pycolmap.Camera(best.cameras[number].todict())
            lens.rescale(*_fit(*image_files.read_size(by_key[image.name].path), options.side))
            found[number], pinholes[number] = lens, pycolmap.undistort_camera(limits, lens)
    sparse = model_from_reconstruction(best, pinholes=pinholes)
    numbers = {best.images[i].name: best.images[i].camera_id for i in best.reg_image_ids()}
    return Registration(
        sparse,
        tuple(by_key[name].path for name in sparse.names),
        tuple(found[numbers[name]] for name in sparse.names),
        left_out,
        settled,
        float(best.compute_mean_reprojection_error()),
        positions,
    )
