"""Structure from motion: a folder of overlapping photos becomes cameras, sparse points and undistorted pictures.

pycolmap does it on the CPU: SIFT features, matches of photos that look alike, incremental or global
mapping. Features and matches may use several threads, since each photo and each pair is independent
and its random numbers start from the seed. Mapping uses one thread. So a run repeats to the bit.
"""

import logging
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmVerdict
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import ColmapModel, intersect_rays, model_from_reconstruction
from dav_gswt.photos.lenses import undistort_photo
from dav_gswt.photos.photo_files import convert_equivalent, name_pictures, read_focal_length
from dav_gswt.photos.photo_listing import PhotoListing, Source, drop_twins, list_photos
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos
from dav_gswt.photos.sfm.gps import GpsPositions, align_to_gps, read_gps_positions
from dav_gswt.photos.sfm.mapping import LEAST_PHOTOS, SfmPhoto, SfmScene, find_solution, require_motion
from dav_gswt.photos.sfm.verdict import require_trust
from dav_gswt.threads import map_ahead

_log = logging.getLogger(__name__)

GUESS = 1.2  # focal length in longer sides, where EXIF has none; then it is refined
LEAST_ANGLE = 2.0  # degrees, median over the points of the widest angle under which photos see them
NEIGHBOURS = 12  # photos that each is matched with


@dataclass(frozen=True)
class SfmOptions:
    """How structure from motion is run.

    side: longer side of the undistorted pictures, pixels (photos are never enlarged). focal: 35 mm
    equivalent where EXIF has none or is wrong. size: longer side at which features are searched.
    features: most of them in a photo. threads: for features and matches; changes no result.
    """

    side: int = 1024
    focal: float | None = None
    size: int = 1024
    features: int = 4096
    threads: int = 1
    seed: int = 0


@dataclass(frozen=True)
class Registration:
    """Photos that found their place. model: of the undistorted pictures, in an arbitrary world frame; in metres east,
    north and up of `positions` where the photos have any.

    sources, lenses: of each of the model's images the photo and its distorted camera at the size of the picture.
    left_out: names and reasons. focal: how the focal length was settled; None where the model was given. error: mean
    reprojection error at the size at which features were looked for, pixels. verdict: None where the model was given.
    """

    model: ColmapModel
    sources: tuple[Path, ...]
    lenses: tuple[pycolmap.Camera, ...]
    left_out: tuple[tuple[str, str], ...]
    focal: FocalLength | None
    error: float
    positions: GpsPositions | None = None
    verdict: SfmVerdict | None = None


def register_photos(source: Source, options: SfmOptions) -> Registration:
    """Register the photos of a folder and its subfolders (`list_photos`), each content once.

    Photos that cannot be read are left out, with the reason. One radial distortion term a camera. Where EXIF has a
    focal length it is held, unless the photos fix it (see `focal`). GPS positions give metres and north, where the
    photos have them and agree (see `gps`).
    Raises: InputError: no folder or no photos, fewer than three that can be read, they do not overlap, or a
    model that the verdict refuses or that is degenerate, with the reason.
    """
    listing = list_photos(source)
    unreadable: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="sfm-") as scratch:
        database = Path(scratch) / "database.db"
        photos = _describe_photos(select_photos(listing), options, unreadable)
        photos = _write_shrunk_photos(photos, Path(scratch), options.threads, unreadable)
        for reason in unreadable.values():
            _log.warning("left out: %s", reason)
        require_photos(listing, [photo.path.name for photo in photos], unreadable)
        keys, positions = [p.key for p in photos], read_gps_positions([photo.path for photo in photos])
        with closing(pycolmap.Database.open(database)) as store:
            held = _enter_images(photos, store)
        extract_features(Path(scratch), database, options.size, options.features, options.threads)
        match_photos(len(photos), database, NEIGHBOURS, options.threads, options.seed)
        gps = dict(zip(keys, positions.at, strict=True)) if positions else {}
        scene = SfmScene(listing.where, photos, held, gps, database)
        require_motion(scene)
        solution = find_solution(scene, options.seed)
    for name, reason in solution.left_out:
        _log.warning("%s is left out: %s", name, reason)
    _log.info("focal length: %s", solution.focal.decision)
    verdict = solution.verdict
    for text in verdict.tried:
        _log.info("structure from motion: %s", text)
    if verdict.grade == "doubtful":
        _log.warning("%s", verdict.describe())
    require_trust(verdict)
    if positions and not align_to_gps(solution.best, gps, options.seed):
        positions = None
    model, lenses = replace_lenses(solution.best, {photo.key: photo.full for photo in photos}, options.side)
    require_parallax(intersect_rays(model)[1])
    by_key = {photo.key: photo.path for photo in photos}
    return Registration(
        model,
        tuple(by_key[name] for name in model.names),
        lenses,
        (*unreadable.items(), *solution.left_out),
        solution.focal,
        float(solution.best.compute_mean_reprojection_error()),
        positions,
        verdict,
    )


def require_parallax(spread: Float[Array, "n"]) -> None:
    """spread: 1 - cos of the angle under which each point is seen. Raises: InputError: photos without parallax."""
    if len(spread) and np.degrees(np.arccos(1 - np.clip(np.median(spread), 0, 2))) < LEAST_ANGLE:
        raise InputError(
            "the photos were taken from nearly one spot: nothing can be said of heights and distances; "
            "move between photos by a quarter of the height over the ground"
        )


def undistort_pixels(registered: Registration, index: int, photo: Float32[Array, "m n 3"]) -> Float32[Array, "h w 3"]:
    """The picture of the model's image `index`, of its photo.

    The photo is shrunk by area means to the picture's resolution, then sampled (`undistort_photo`).
    """
    lens, camera = registered.lenses[index], registered.model.cameras[index]
    return undistort_photo(image_files.shrink_image(photo, lens.width, lens.height), lens, camera)


def select_photos(listing: PhotoListing) -> dict[str, Path]:
    """The photos of a listing by name, each content once. What is skipped is said in the log."""
    for note in listing.notes:
        _log.warning("%s", note)
    photos, twins = drop_twins(listing.photos)
    if twins:
        copy, kept = next(iter(twins.items()))
        _log.warning(
            "copies among the %d photos: %d (%s of %s); each counts once", len(listing.photos), len(twins), copy, kept
        )
    return photos


def require_photos(listing: PhotoListing, names: Sequence[str], unreadable: Mapping[str, str]) -> None:
    """Raises: InputError: fewer photos than structure from motion needs, with what became of the others."""
    if len(names) < LEAST_PHOTOS:
        had = f"only {' and '.join(names)}" if names else "no photos"
        notes = "".join(f" ({note})" for note in listing.notes)
        problem = next(iter(unreadable.values()), f"{listing.where}: {had}{notes}")
        raise InputError(f"{problem} (at least {LEAST_PHOTOS} overlapping photos are needed, better 20)")


def _describe_photos(paths: Mapping[str, Path], options: SfmOptions, unreadable: dict[str, str]) -> list[SfmPhoto]:
    """The photos that can be read. unreadable: gets the others, with the reason."""
    photos = []
    for (name, path), key in zip(paths.items(), name_pictures(list(paths)), strict=True):
        try:
            full = image_files.read_size(path)
        except InputError as error:
            unreadable[name] = str(error)
            continue
        width, height = image_files.fit_size(*full, options.size)
        pixels = convert_equivalent(options.focal, *full) if options.focal else read_focal_length(path)
        photos.append(SfmPhoto(path, key, full, width, height, pixels and pixels * width / full[0]))
    return photos


def _enter_images(photos: list[SfmPhoto], store: pycolmap.Database) -> dict[int, float]:
    """Enter images, numbered in the photos' order, and a camera for each size and focal length of EXIF.

    Returns EXIF's focal length of the cameras that have one.
    """
    cameras, held = {}, {}
    for photo in photos:
        lens = photo.full, photo.focal
        if lens not in cameras:
            focal = photo.focal or GUESS * max(photo.width, photo.height)
            camera = pycolmap.Camera.create_from_model_name(1, "SIMPLE_RADIAL", focal, photo.width, photo.height)
            camera.has_prior_focal_length = photo.focal is not None
            cameras[lens] = enter_camera(store, camera)
            if photo.focal:
                held[camera.camera_id] = photo.focal
        enter_image(store, photo.key, *cameras[lens])
    return held


def _write_shrunk_photos(
    photos: list[SfmPhoto], folder: Path, threads: int, unreadable: dict[str, str]
) -> list[SfmPhoto]:
    """Write what features are looked for in: the photos shrunk by area means, grey by Rec. 601.

    Returns the photos that can be read. unreadable: gets the others, with the reason.
    """

    def write(photo: SfmPhoto) -> str | None:
        try:
            image = image_files.read_shrunk_photo(photo.path, max(photo.width, photo.height))
        except InputError as error:
            return str(error)
        grey = image @ np.array([0.299, 0.587, 0.114], np.float32)
        image_files.write_png(folder / photo.key, np.repeat(grey[..., None], 3, axis=2))
        return None

    reasons = list(map_ahead(write, progress(photos, "read photos"), threads))
    pairs = list(zip(photos, reasons, strict=True))
    unreadable |= {photo.path.name: reason for photo, reason in pairs if reason}
    return [photo for photo, reason in pairs if not reason]


def replace_lenses(
    best: pycolmap.Reconstruction, full: Mapping[str, tuple[int, int]], side: int
) -> tuple[ColmapModel, tuple[pycolmap.Camera, ...]]:
    """The model with a pinhole in place of each lens, and the lenses of its images, both at the size of the pictures.

    full: sizes of the photos by the images' names.
    """
    limits = pycolmap.UndistortCameraOptions(blank_pixels=0, max_image_size=side)
    numbers = {best.images[i].name: best.images[i].camera_id for i in best.reg_image_ids()}
    lenses, pinholes = {}, {}
    for name, number in numbers.items():
        if number not in lenses:
            lens = pycolmap.Camera(best.cameras[number].todict())
            lens.rescale(*image_files.fit_size(*full[name], side))
            lenses[number], pinholes[number] = lens, pycolmap.undistort_camera(limits, lens)
    model = model_from_reconstruction(best, pinholes=pinholes)
    return model, tuple(lenses[numbers[name]] for name in model.names)


def triangulate_features(
    known: pycolmap.Reconstruction, folder: Path, neighbours: int, options: SfmOptions
) -> pycolmap.Reconstruction:
    """A model with points where rays through matched SIFT features cross, by one thread. Cameras and poses stay.

    known: cameras and images by numbers from 1 on, without points. folder: of the pictures, by the images' names.
    neighbours: pictures that each is matched with.
    """
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        database = Path(scratch) / "database.db"
        with closing(pycolmap.Database.open(database)) as store:
            numbers = {key: enter_camera(store, camera) for key, camera in sorted(known.cameras.items())}
            for _, image in sorted(known.images.items()):
                enter_image(store, image.name, *numbers[image.camera_id])
        extract_features(folder, database, options.size, options.features, options.threads)
        match_photos(known.num_images(), database, neighbours, options.threads, options.seed)
        choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed)
        choice.triangulation.random_seed = choice.mapper.random_seed = options.seed
        choice.mapper.num_threads = 1
        return pycolmap.triangulate_points(known, database, folder, scratch, options=choice)
