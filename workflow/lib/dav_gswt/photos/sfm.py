"""Structure from motion: a folder of overlapping photos becomes cameras, sparse points and undistorted pictures.

pycolmap does it on the CPU: SIFT features, every photo matched with every other, incremental mapping. Features and
matches may use several threads, since each photo and each pair stands alone and its random numbers start from the seed;
mapping uses one. So a run repeats to the bit.
"""

import logging
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float32
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates

from dav_gswt import images
from dav_gswt.errors import InputError
from dav_gswt.logs import progress
from dav_gswt.photos import exif, model
from dav_gswt.photos.model import Model

_log = logging.getLogger(__name__)

LEAST_PHOTOS = 3
LOOK = 4.0  # seconds between two looks at how far a long step is
GUESS = 1.2  # focal length in longer sides, where EXIF has none; then it is refined


@dataclass(frozen=True)
class Options:
    """How structure from motion is run.

    size: longer side at which features are looked for, pixels. features: most of them in a photo. side: longer side of
    the undistorted pictures, pixels (photos are never enlarged). threads: for features and matches; changes no result.
    """

    size: int = 1024
    features: int = 4096
    side: int = 1024
    threads: int = 1
    seed: int = 0


@dataclass(frozen=True)
class Registered:
    """Photos that found their place. model: of the undistorted pictures, in an arbitrary world frame.

    sources, lenses: of each of the model's images the photo and its distorted camera at the size of the picture.
    left_out: names and reasons. focal_ratio: final focal length over EXIF's, median; None where EXIF has none.
    error: mean reprojection error at the size at which features were looked for, pixels.
    """

    model: Model
    sources: tuple[Path, ...]
    lenses: tuple[pycolmap.Camera, ...]
    left_out: tuple[tuple[str, str], ...]
    focal_ratio: float | None
    error: float


@dataclass(frozen=True)
class _Photo:
    path: Path
    key: str  # name of the picture that is made of it
    width: int  # at the size at which features are looked for
    height: int
    focal: float | None  # EXIF's, at that size


def register(folder: Path | str, options: Options) -> Registered:
    """Register the photos that lie in a folder.

    One camera with one radial distortion term for all photos of equal size and EXIF focal length. Where EXIF has a
    focal length it is held: seen from straight above, flat ground hardly fixes it. Else it is refined.
    Raises: InputError: no folder or no photos, fewer than three, one that cannot be read, or they do not overlap.
    """
    paths = images.listed(folder)
    if len(paths) < LEAST_PHOTOS:
        names = " and ".join(p.name for p in paths)
        raise InputError(f"{folder}: only {names}; at least {LEAST_PHOTOS} overlapping photos are needed, better 20")
    with tempfile.TemporaryDirectory(prefix="sfm-") as scratch:
        database = Path(scratch) / "database.db"
        photos = [_described(p, key, options.size) for p, key in zip(paths, _keys(paths), strict=True)]
        _shrink(photos, Path(scratch))
        with closing(pycolmap.Database.open(database)) as store:
            held = _enter(photos, store)
        _find_features(len(photos), Path(scratch), database, options)
        _match(len(photos), database, options)
        found = _map(len(photos), held, database, Path(scratch), options)
        best = max(found.values(), key=lambda r: (r.num_reg_images(), r.num_points3D()), default=None)
        left_out = _left_out(photos, best, database)
    placed = len(photos) - len(left_out)
    if placed < LEAST_PHOTOS:
        raise InputError(
            f"{folder}: {placed} of {len(photos)} photos could be placed relative to each other; they must overlap by "
            "more than half and show texture: take more from closer positions, or remove what shows something else"
        )
    for name, reason in left_out:
        _log.warning("%s is left out: %s", name, reason)
    return _undistortable(photos, best, left_out, options)


def undistorted(registered: Registered, index: int) -> Float32[Array, "h w 3"]:
    """The picture of the model's image `index`: the photo as a pinhole camera would have taken it.

    The photo is shrunk by area means to the picture's resolution, then sampled by cubic splines, each channel alone.
    """
    lens, camera = registered.lenses[index], registered.model.cameras[index]
    photo = images.resized(images.read(registered.sources[index]), lens.width, lens.height)
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = np.stack([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)], -1).reshape(-1, 3)
    column, row = (lens.img_from_cam(rays) - 0.5).T.reshape(2, camera.height, camera.width)
    planes = [map_coordinates(photo[..., c], [row, column], order=3, mode="nearest") for c in range(3)]
    return np.clip(np.stack(planes, -1), 0, 1).astype(np.float32)


def _keys(paths: list[Path]) -> list[str]:
    """Names of the pictures made of photos: the stem, with the old suffix where two would be equal."""
    stems = Counter(p.stem for p in paths)
    return [f"{p.stem}.png" if stems[p.stem] == 1 else f"{p.stem}_{p.suffix[1:]}.png" for p in paths]


def _fit(width: int, height: int, longest: int) -> tuple[int, int]:
    share = min(1.0, longest / max(width, height))
    return max(1, round(width * share)), max(1, round(height * share))


def _described(path: Path, key: str, longest: int) -> _Photo:
    full = images.size(path)
    width, height = _fit(*full, longest)
    focal = exif.focal_length(path)
    return _Photo(path, key, width, height, focal and focal * width / full[0])


def _enter(photos: list[_Photo], store: pycolmap.Database) -> dict[int, float]:
    """Enter cameras and images, numbered in the photos' order; returns EXIF's focal length of those that have one."""
    cameras, held = {}, {}
    for photo in photos:
        lens = (photo.width, photo.height, photo.focal)
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
        image = images.resized(images.read(photo.path), photo.width, photo.height)
        grey = image @ np.array([0.299, 0.587, 0.114], np.float32)
        images.write(folder / photo.key, np.repeat(grey[..., None], 3, axis=2))


def _find_features(count: int, folder: Path, database: Path, options: Options) -> None:
    """Find SIFT features in every photo."""
    choice = pycolmap.FeatureExtractionOptions(num_threads=options.threads, use_gpu=False, max_image_size=options.size)
    choice.sift.max_num_features = options.features
    _watched(
        lambda token: pycolmap.extract_features(
            database, folder, extraction_options=choice, device=pycolmap.Device.cpu, cancellation_token=token
        ),
        lambda: _rows(database, "keypoints"),
        count,
        "find features",
    )


def _match(count: int, database: Path, options: Options) -> None:
    """Match every photo with every other and keep what one rigid scene explains."""
    matching = pycolmap.FeatureMatchingOptions(num_threads=options.threads, use_gpu=False)
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = options.seed
    _watched(
        lambda token: pycolmap.match_exhaustive(
            database, matching, verification_options=verification, device=pycolmap.Device.cpu, cancellation_token=token
        ),
        lambda: _rows(database, "two_view_geometries"),
        count * (count - 1) // 2,
        "match pairs of photos",
    )


def _map(count: int, held: dict[int, float], database: Path, scratch: Path, options: Options):
    """Incremental mapping; where only some cameras have a known focal length, those stay as they are until the end."""
    choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed, max_num_models=3)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = choice.triangulation.random_seed = options.seed
    with closing(pycolmap.Database.open(database)) as store:
        mixed = 0 < len(held) < store.num_cameras()
    if held and not mixed:
        choice.ba_refine_focal_length = choice.mapper.abs_pose_refine_focal_length = False
    if mixed:
        choice.constant_cameras = set(held)
    placed = []
    found = _watched(
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
        adjustment = pycolmap.BundleAdjustmentOptions(refine_focal_length=False, print_summary=False)
        adjustment.ceres.solver_options.num_threads = 1
        for reconstruction in found.values():
            pycolmap.bundle_adjustment(reconstruction, adjustment)
    return found


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
    photos: list[_Photo], best: pycolmap.Reconstruction, left_out: tuple, options: Options
) -> Registered:
    """Bring cameras to the size of the pictures, and give each its pinhole."""
    by_key = {photo.key: photo for photo in photos}
    error, ratios = best.compute_mean_reprojection_error(), []
    lenses, pinholes = {}, {}
    limits = pycolmap.UndistortCameraOptions(blank_pixels=0, max_image_size=options.side)
    for i in best.reg_image_ids():
        image = best.images[i]
        photo, number = by_key[image.name], image.camera_id
        if photo.focal:
            ratios.append(image.camera.focal_length / photo.focal)
        if number not in lenses:
            lens = pycolmap.Camera(image.camera.todict())
            lens.rescale(*_fit(*images.size(photo.path), options.side))
            lenses[number], pinholes[number] = lens, pycolmap.undistort_camera(limits, lens)
    sparse = model.of(best, pinholes=pinholes)
    numbers = {best.images[i].name: best.images[i].camera_id for i in best.reg_image_ids()}
    return Registered(
        sparse,
        tuple(by_key[name].path for name in sparse.names),
        tuple(lenses[numbers[name]] for name in sparse.names),
        left_out,
        float(np.median(ratios)) if ratios else None,
        float(error),
    )


def _watched(work: Callable, done: Callable[[], int], total: int, what: str):
    """Do a long piece of work in a thread and report meanwhile how much is done; Ctrl-C stops it."""
    token = pycolmap.CancellationToken()
    with ThreadPoolExecutor(1) as pool, progress(None, what, total=total) as bar:
        job = pool.submit(work, token)
        try:
            while wait([job], timeout=LOOK).not_done:
                bar.update(max(0, done() - bar.n))
        except BaseException:
            token.cancel()
            raise
        bar.update(max(0, total - bar.n))
    return job.result()


def _rows(database: Path, table: str) -> int:
    """Rows of a table that another thread is filling; 0 while it is locked.

    Asked by another process: two copies of SQLite in one process, Python's and pycolmap's, drop each other's locks
    when they close the file, and the writer dies of it.
    """
    ask = "import sqlite3, sys; print(*sqlite3.connect(sys.argv[1], uri=True).execute(sys.argv[2]).fetchone())"
    words = [sys.executable, "-S", "-c", ask, f"file:{database}?mode=ro", f"SELECT COUNT(*) FROM {table}"]
    told = subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()
    return int(told) if told.isdecimal() else 0
