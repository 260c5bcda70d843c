"""Structure from motion: a folder of overlapping photos becomes cameras, sparse points and undistorted pictures.

pycolmap does it on the CPU: SIFT features, matches of photos that look alike, incremental or global mapping. Features
and matches may use several threads, since each photo and each pair stands alone and its random numbers start from the
seed; mapping uses one. So a run repeats to the bit. Where signs contradict the model (see `verdict`), photos are mapped
in other ways too, and the best model is taken.
"""

import logging
import tempfile
from collections import Counter, defaultdict
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmVerdict
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos import exif
from dav_gswt.photos.colmap_model import ColmapModel, measure_parallax, model_from_reconstruction
from dav_gswt.photos.exif import read_focal_length
from dav_gswt.photos.lenses import undistort_photo
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos
from dav_gswt.photos.sfm.focal_length import require_parallax, settle_focal_length
from dav_gswt.photos.sfm.gps import GpsPositions, align_to_gps, read_gps_positions
from dav_gswt.photos.sfm.mapping import (
    Approach,
    Mapper,
    list_alternatives,
    other_mapper,
    run_mapping,
    write_pose_priors,
)
from dav_gswt.photos.sfm.verdict import COVERAGE, LEAST_INLIERS, SfmEvidence, find_groups, judge_model, require_trust
from dav_gswt.threads import map_ahead

_log = logging.getLogger(__name__)

LEAST_PHOTOS = 3
UNSURE = 0.1  # share of the photos: so many left out, though they match placed ones, are tried with the other mapper
LEAST_PLACED = 0.8  # of the photos that the first way of mapping places: as many another must place
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
    pixels (photos are never enlarged). verdict: stop or warn where the model is refused. threads: for features and
    matches; changes no result.
    """

    size: int = 1024
    features: int = 4096
    neighbours: int = 12
    mapper: Mapper = "incremental"
    cameras: str = "auto"
    focal: float | None = None
    side: int = 1024
    verdict: str = "stop"
    threads: int = 1
    seed: int = 0


def choose_sfm_options(scene: dict, threads: int) -> SfmOptions:
    """The options that a scene's entry of the config asks for."""
    given: dict[str, Any] = {"size": 1024} | PRESETS[scene.get("sfm", "quick")]
    given |= {key: scene[key] for key in ("mapper", "cameras", "focal", "verdict") if key in scene}
    given["size"] = min(given["size"], max(1024, scene["size"]))
    return SfmOptions(**given, side=scene["size"], threads=threads)


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
    model that the verdict refuses or that is degenerate, with the reason.
    """
    paths = image_files.list_photos(folder)
    if len(paths) < LEAST_PHOTOS:
        names = " and ".join(p.name for p in paths)
        raise InputError(f"{folder}: only {names}; at least {LEAST_PHOTOS} overlapping photos are needed, better 20")
    photos = [_describe_photo(p, key, options) for p, key in zip(paths, _name_pictures(paths), strict=True)]
    positions = read_gps_positions(paths)
    with tempfile.TemporaryDirectory(prefix="sfm-") as scratch:
        database = Path(scratch) / "database.db"
        _write_shrunk_photos(photos, Path(scratch), options.threads)
        with closing(pycolmap.Database.open(database)) as store:
            held = _enter_images(photos, store, options)
        extract_features(Path(scratch), database, options.size, options.features, options.threads)
        match_photos(len(photos), database, options.neighbours, options.threads, options.seed)
        scene = _Scene(folder, photos, held, positions, database)
        solution = _find_solution(scene, options)
    for name, reason in solution.left_out:
        _log.warning("%s is left out: %s", name, reason)
    _log.info("focal length: %s", solution.focal.decision)
    _report_verdict(solution.verdict)
    if options.verdict == "stop":
        require_trust(solution.verdict)
    if positions and not align_to_gps(solution.best, scene.gps):
        positions = None
    made = _finish_registration(photos, solution, options, positions)
    require_parallax(measure_parallax(made.model))
    return made


def _report_verdict(verdict: SfmVerdict) -> None:
    if verdict.grade == "good":
        _log.info("structure from motion: good, by %s", ", ".join(sign.name for sign in verdict.signs))
    for sign in verdict.objections:
        _log.warning("structure from motion is %s: %s", sign.grade, sign.reason)
    for text in verdict.tried[1:]:
        _log.info("tried: %s", text)


def undistort_image(registered: Registration, index: int) -> Float32[Array, "h w 3"]:
    """The picture of the model's image `index`: the photo as a pinhole camera would have taken it.

    The photo is shrunk by area means to the picture's resolution, then sampled (`undistort_photo`).
    """
    lens, camera = registered.lenses[index], registered.model.cameras[index]
    photo = image_files.shrink_image(image_files.read_photo(registered.sources[index]), lens.width, lens.height)
    return undistort_photo(photo, lens, camera)


def _name_pictures(paths: list[Path]) -> list[str]:
    """Names of the pictures made of photos: the stem, with the old suffix where two would be equal."""
    stems = Counter(p.stem for p in paths)
    return [f"{p.stem}.png" if stems[p.stem] == 1 else f"{p.stem}_{p.suffix[1:]}.png" for p in paths]


def _fit_size(width: int, height: int, longest: int) -> tuple[int, int]:
    share = min(1.0, longest / max(width, height))
    return max(1, round(width * share)), max(1, round(height * share))


def _describe_photo(path: Path, key: str, options: SfmOptions) -> _Photo:
    full = image_files.read_size(path)
    width, height = _fit_size(*full, options.size)
    given = options.focal and options.focal / exif.FILM_DIAGONAL * float(np.hypot(*full))
    pixels = given or read_focal_length(path)
    return _Photo(path, key, width, height, pixels and pixels * width / full[0])


def _enter_images(photos: list[_Photo], store: pycolmap.Database, options: SfmOptions) -> dict[int, float]:
    """Enter cameras and images, numbered in the photos' order; returns EXIF's focal length of those that have one."""
    cameras, held = {}, {}
    for i, photo in enumerate(photos):
        lens = {"auto": (photo.width, photo.height, photo.focal), "one": (photo.width, photo.height), "each": i}
        lens = lens[options.cameras]
        if lens not in cameras:
            focal = photo.focal or GUESS * max(photo.width, photo.height)
            camera = pycolmap.Camera.create_from_model_name(1, "SIMPLE_RADIAL", focal, photo.width, photo.height)
            camera.has_prior_focal_length = photo.focal is not None
            cameras[lens] = enter_camera(store, camera)
            if photo.focal:
                held[camera.camera_id] = photo.focal
        enter_image(store, photo.key, *cameras[lens])
    return held


def _write_shrunk_photos(photos: list[_Photo], folder: Path, threads: int) -> None:
    """Write what features are looked for in: the photos shrunk by area means, grey by Rec. 601."""

    def write(photo: _Photo) -> None:
        image = image_files.shrink_image(image_files.read_photo(photo.path), photo.width, photo.height)
        grey = image @ np.array([0.299, 0.587, 0.114], np.float32)
        image_files.write_png(folder / photo.key, np.repeat(grey[..., None], 3, axis=2))

    for _ in map_ahead(write, progress(photos, "read photos"), threads):
        pass


@dataclass(frozen=True)
class _Scene:
    """What mapping starts from. held: EXIF's focal lengths by camera."""

    folder: Path | str
    photos: list[_Photo]
    held: dict[int, float]
    positions: GpsPositions | None
    database: Path

    @property
    def gps(self) -> dict[str, Float[Array, "3"]]:
        """GPS positions by the images' names; empty where the photos have none."""
        if self.positions is None:
            return {}
        return {photo.key: at for photo, at in zip(self.photos, self.positions.at, strict=True)}


@dataclass(frozen=True)
class _Solution:
    """A model and what is thought of it. best: its focal length is settled. left_out: names and reasons.

    unsure: how many of those left out match a placed photo well.
    """

    best: pycolmap.Reconstruction
    left_out: tuple[tuple[str, str], ...]
    focal: FocalLength
    verdict: SfmVerdict
    unsure: int = 0


def _find_solution(scene: _Scene, options: SfmOptions) -> _Solution:
    """Map the photos; in other ways as well where the signs contradict the model, or where many photos are left out
    though they match others. The best by the signs, then by the photos that it places.
    """
    first = Approach(options.mapper)
    solved, tried = [_solve(first, scene, options)], []
    tried.append(_describe_try(first, solved[0].verdict))
    for approach in _list_other_ways(first, solved[0], scene):
        _log.info("try %s", approach)
        try:
            solved.append(_solve(approach, scene, options))
            tried.append(_describe_try(approach, solved[-1].verdict))
        except InputError as error:
            tried.append(f"{approach}: {error}")
    least = LEAST_PLACED * solved[0].best.num_reg_images()
    enough = [solution for solution in solved if solution.best.num_reg_images() >= least]
    best = min(enough, key=lambda solution: (*_count_objections(solution.verdict), -solution.best.num_reg_images()))
    return replace(best, verdict=replace(best.verdict, tried=tuple(tried)))


def _list_other_ways(first: Approach, solution: _Solution, scene: _Scene) -> list[Approach]:
    """Other ways of mapping that may give a better model than the first did."""
    against = [sign.reason for sign in solution.verdict.objections if sign.name not in COVERAGE]
    if against:
        _log.info("the model is in doubt: %s", against[0])
        ratio = solution.focal.ratio
        freed = ratio is not None and not np.isclose(ratio, 1, rtol=1e-9)
        return list_alternatives(first, freed, scene.positions is not None)
    if solution.unsure and solution.unsure >= UNSURE * len(scene.photos):
        _log.info("%d photos have no place, though they match others", solution.unsure)
        return [Approach(other_mapper(first.mapper))]
    return []


def _describe_try(approach: Approach, verdict: SfmVerdict) -> str:
    reasons = "; ".join(sign.reason for sign in verdict.objections)
    return f"{approach}: {verdict.grade}" + (f" ({reasons})" if reasons else "")


def _count_objections(verdict: SfmVerdict) -> tuple[int, int, int]:
    """The worse, the greater: the grade, then refused and all signs against the model."""
    refused = sum(sign.grade == "refused" for sign in verdict.objections)
    return ("good", "doubtful", "refused").index(verdict.grade), refused, len(verdict.objections)


def _solve(approach: Approach, scene: _Scene, options: SfmOptions) -> _Solution:
    """Map in one way. Raises: InputError: too few photos found a place, or a focal length that no lens has."""
    photos, database = scene.photos, scene.database
    write_pose_priors(database, scene.gps if approach.use_gps else {})
    found = run_mapping(approach, database, database.parent, scene.held, options.seed)
    best = max(found, key=lambda r: (r.num_reg_images(), r.num_points3D()), default=None)
    pairs = _read_pairs(database)
    shared = _count_shared(best, pairs)
    left_out = _left_out(photos, best, shared)
    placed = len(photos) - len(left_out)
    if best is None or placed < LEAST_PHOTOS:
        raise InputError(
            f"{scene.folder}: {placed} of {len(photos)} photos could be placed relative to each other; they must "
            "overlap by more than half and show texture: take more from closer positions, or remove what shows "
            "something else"
        )
    settled = settle_focal_length(best, scene.held, np.random.default_rng(options.seed), approach.hold_focal)
    model = model_from_reconstruction(best)
    gps = scene.gps
    evidence = SfmEvidence(
        error=float(best.compute_mean_reprojection_error()),
        images=len(photos),
        focal_ratio=settled.free / settled.exif if settled.free and settled.exif else None,
        positions=np.stack([gps[name] for name in model.names]) if gps else None,
        groups=find_groups([photo.path.name for photo in photos], pairs, [i - 1 for i in best.reg_image_ids()]),
    )
    verdict = judge_model(model, evidence, np.random.default_rng(options.seed))
    return _Solution(best, left_out, settled, verdict, sum(count >= LEAST_INLIERS for count in shared.values()))


def _read_pairs(database: Path) -> list[tuple[int, int, int]]:
    """Per verified pair the indices of its photos, and how many matches one rigid scene explains."""
    with closing(pycolmap.Database.open(database)) as store:
        rows = list(zip(*store.read_two_view_geometry_num_inliers(), strict=True))
    pairs = ((*pycolmap.pair_id_to_image_pair(pair), inliers) for pair, inliers in rows)
    return [(one - 1, two - 1, inliers) for one, two, inliers in pairs]


def _count_shared(best: pycolmap.Reconstruction | None, pairs: list[tuple[int, int, int]]) -> dict[int, int]:
    """Of photos that found no place but match placed ones: the most points that each shares with one of them."""
    placed = {number - 1 for number in best.reg_image_ids()} if best else set()
    most = defaultdict(int)
    for one, two, inliers in pairs:
        for index, other in ((one, two), (two, one)):
            if other in placed and index not in placed:
                most[index] = max(most[index], inliers)
    return most


def _left_out(photos: list[_Photo], best: pycolmap.Reconstruction | None, shared: dict[int, int]) -> tuple:
    """Names of the photos that found no place, with the reason."""
    placed = {number - 1 for number in best.reg_image_ids()} if best else set()
    out = []
    for index, photo in enumerate(photos):
        if index not in placed:
            most = shared.get(index, 0)
            unsure = f"it shares {most} points with a placed photo, but its position stays unsure"
            out.append((photo.path.name, unsure if most else "it matches no photo that could be placed"))
    return tuple(out)


def _finish_registration(
    photos: list[_Photo], solution: _Solution, options: SfmOptions, positions: GpsPositions | None
) -> Registration:
    """Bring cameras to the size of the pictures, and give each its pinhole."""
    best = solution.best
    by_key = {photo.key: photo for photo in photos}
    found, pinholes = {}, {}
    limits = pycolmap.UndistortCameraOptions(blank_pixels=0, max_image_size=options.side)
    for i in best.reg_image_ids():
        image = best.images[i]
        number = image.camera_id
        if number not in found:
            lens = pycolmap.Camera(best.cameras[number].todict())
            lens.rescale(*_fit_size(*image_files.read_size(by_key[image.name].path), options.side))
            found[number], pinholes[number] = lens, pycolmap.undistort_camera(limits, lens)
    sparse = model_from_reconstruction(best, pinholes=pinholes)
    numbers = {best.images[i].name: best.images[i].camera_id for i in best.reg_image_ids()}
    return Registration(
        sparse,
        tuple(by_key[name].path for name in sparse.names),
        tuple(found[numbers[name]] for name in sparse.names),
        solution.left_out,
        solution.focal,
        float(best.compute_mean_reprojection_error()),
        positions,
        solution.verdict,
    )
