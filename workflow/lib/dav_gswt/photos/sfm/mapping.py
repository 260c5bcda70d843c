"""Mapping: features and matches become cameras and points, by COLMAP in one thread.

Photos are mapped in one way. If that fails, or if signs contradict the model (see `verdict`), they
are mapped in other ways too, and the best model is taken.

Photos of flat ground from straight above hardly determine the focal length: a longer lens higher up
gives the same pictures. So EXIF's focal length is held there. Oblique photos determine it, and then
the adjusted one is used.
"""

import logging
from collections import defaultdict
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmVerdict
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import bundle_adjust, group_images, model_from_reconstruction
from dav_gswt.photos.ground_frame import fit_plane
from dav_gswt.photos.sfm.features import run_cancellable
from dav_gswt.photos.sfm.gps import fill_altitudes
from dav_gswt.photos.sfm.verdict import COVERAGE, LEAST_INLIERS, LEAST_TIES, judge_model

_log = logging.getLogger(__name__)

LEAST_PHOTOS = 3
UNSURE = 0.1  # share of the photos that are left out though they match: above it the other mapper is tried
LEAST_PLACED = 0.8  # of the photos that the first way of mapping places: as many another must place
OBLIQUE = 20.0  # degrees off the vertical from which a view helps to fix the focal length
LEAST_OBLIQUE, LEAST_SHARE = 3, 0.15  # oblique views that fix it: a number, and a share of all
HELD = 0.03  # an adjusted focal length this close to EXIF's confirms it
STILL = 0.01  # of the longer side: pictures that move less, median over the pairs, are of a camera that stood still
LENSES = 0.35, 6.0  # focal length in longer sides of the picture: a fisheye's to a long telescope's


@dataclass(frozen=True)
class Approach:
    """A way of mapping. hold_focal: EXIF's focal length stays, whatever photos say."""

    mapper: Literal["incremental", "global"]
    hold_focal: bool = False

    def __str__(self) -> str:
        return f"{self.mapper} mapping{', EXIF focal length held' if self.hold_focal else ''}"


@dataclass(frozen=True)
class SfmPhoto:
    """A photo that structure from motion is given.

    key: name of the picture that is made of it. full: its size. width, height, focal: at the size
    at which features are searched; focal is EXIF's.
    """

    path: Path
    key: str
    full: tuple[int, int]
    width: int
    height: int
    focal: float | None


@dataclass(frozen=True)
class SfmScene:
    """The input of mapping. held: EXIF's focal lengths by camera. gps: positions by the images' names; empty if the
    photos have none. database: COLMAP's, of features and matches."""

    folder: Path | str
    photos: list[SfmPhoto]
    held: dict[int, float]
    gps: dict[str, Float[Array, "3"]]
    database: Path


@dataclass(frozen=True)
class SfmSolution:
    """A model with its settled focal length, and the verdict on it. left_out: names and reasons.

    unsure: the number of photos left out that match a placed photo well.
    """

    best: pycolmap.Reconstruction
    left_out: tuple[tuple[str, str], ...]
    focal: FocalLength
    verdict: SfmVerdict
    unsure: int = 0


def find_solution(scene: SfmScene, seed: int) -> SfmSolution:
    """Map the photos, in several ways if the first one fails, if signs contradict its model, or if
    it leaves out many photos that match others. The best by the signs is taken, then by the number
    of placed photos.

    Raises: InputError: of the first way, if none gives a model.
    """
    solved: list[SfmSolution] = []
    tried: list[str] = []

    def attempt(approach: Approach) -> InputError | None:
        try:
            solved.append(_solve(approach, scene, seed))
        except InputError as error:
            tried.append(f"{approach}: {error}")
            return error
        verdict = solved[-1].verdict
        reasons = "; ".join(sign.reason for sign in verdict.objections)
        tried.append(f"{approach}: {verdict.grade}" + (f" ({reasons})" if reasons else ""))
        return None

    def rank(solution: SfmSolution) -> tuple[int, ...]:
        """The lower, the better."""
        objections = solution.verdict.objections
        refused = sum(sign.grade == "refused" for sign in objections)
        grade = ("good", "doubtful", "refused").index(solution.verdict.grade)
        return grade, refused, len(objections), -solution.best.num_reg_images()

    failure = attempt(Approach("incremental"))
    for approach in _list_other_ways(solved[0] if solved else None, scene):
        _log.info("try %s", approach)
        attempt(approach)
    if failure and not solved:
        raise failure
    least = LEAST_PLACED * solved[0].best.num_reg_images()
    best = min((solution for solution in solved if solution.best.num_reg_images() >= least), key=rank)
    return replace(best, verdict=replace(best.verdict, tried=tuple(tried)))


def _list_other_ways(solution: SfmSolution | None, scene: SfmScene) -> list[Approach]:
    """Other ways of mapping that may give a better model than the first did. solution: None if it gave no model."""
    if solution is None:
        if not any(inliers >= LEAST_INLIERS for *_, inliers in _read_pairs(scene.database)):
            return []
        freed = bool(scene.held)
    elif against := [sign.reason for sign in solution.verdict.objections if sign.name not in COVERAGE]:
        _log.info("the model may be wrong: %s", against[0])
        ratio = solution.focal.ratio
        freed = ratio is not None and not np.isclose(ratio, 1, rtol=1e-9)  # EXIF's focal length was given up
    elif solution.unsure and solution.unsure >= UNSURE * len(scene.photos):
        _log.info("photos without a place, though they match others: %d", solution.unsure)
        return [Approach("global")]
    else:
        return []
    return [Approach("incremental", hold_focal=True)] * freed + [Approach("global", hold_focal=True)]


def _solve(approach: Approach, scene: SfmScene, seed: int) -> SfmSolution:
    """Map in one way. Raises: InputError: too few photos found a place, or a focal length that no lens has."""
    photos, gps = scene.photos, scene.gps
    found = _run_mapping(approach, scene, seed)
    loose = [remove_loose_photos(model) for model in found]
    best, loose = max(
        zip(found, loose, strict=True), key=lambda r: (r[0].num_reg_images(), r[0].num_points3D()), default=(None, {})
    )
    pairs = _read_pairs(scene.database)
    placed = {number - 1 for number in best.reg_image_ids()} if best else set()
    left_out, unsure = explain_left_out(photos, placed, pairs, loose)
    if best is None or len(placed) < LEAST_PHOTOS:
        if not any(inliers >= LEAST_INLIERS for *_, inliers in pairs):
            raise InputError(
                f"{scene.folder}: no two of the {len(photos)} photos show the same ground: photograph one patch that "
                "has texture, so that each photo overlaps the one before by two thirds"
            )
        raise InputError(
            f"{scene.folder}: {len(placed)} of {len(photos)} photos could be placed relative to each other; they must "
            "overlap by more than half and show texture: take more from closer positions, or remove what shows "
            "something else"
        )
    best, settled = settle_focal_length(best, scene.held, np.random.default_rng(seed), approach.hold_focal)
    model, rng = model_from_reconstruction(best), np.random.default_rng(seed)
    positions = fill_altitudes(model, np.stack([gps[name] for name in model.names]), rng) if gps else None
    verdict = judge_model(
        model,
        np.random.default_rng(seed),
        error=float(best.compute_mean_reprojection_error()),
        images=len(photos),
        focal_ratio=settled.free / settled.exif if settled.free and settled.exif else None,
        positions=positions,
    )
    return SfmSolution(best, left_out, settled, verdict, unsure)


def require_motion(scene: SfmScene) -> None:
    """Raises: InputError: of most pairs of photos that match, the pictures are the same but for noise."""
    moves, pairs = [], _read_pairs(scene.database)
    with closing(pycolmap.Database.open(scene.database)) as store:
        places = [store.read_keypoints(i + 1)[:, :2].astype(float) for i in range(len(scene.photos))]
        for one, two, inliers in pairs:
            if inliers >= LEAST_INLIERS:
                matches = store.read_two_view_geometry(one + 1, two + 1).inlier_matches
                off = places[one][matches[:, 0]] - places[two][matches[:, 1]]
                side = max(scene.photos[one].width, scene.photos[one].height)
                moves.append(float(np.median(np.linalg.norm(off, axis=1))) / side)
    if moves and np.median(moves) < STILL:
        raise InputError(
            f"{scene.folder}: the camera stood still: the {len(scene.photos)} photos show the same picture, which says "
            "nothing of heights and distances. Walk or fly over the ground, and take each photo a third of a picture "
            "further on"
        )


def _read_pairs(database: Path) -> list[tuple[int, int, int]]:
    """The indices of the photos of each verified pair, and how many matches one rigid scene explains."""
    with closing(pycolmap.Database.open(database)) as store:
        rows = list(zip(*store.read_two_view_geometry_num_inliers(), strict=True))
    pairs = ((*pycolmap.pair_id_to_image_pair(pair), inliers) for pair, inliers in rows)
    return [(one - 1, two - 1, inliers) for one, two, inliers in pairs]


def remove_loose_photos(best: pycolmap.Reconstruction) -> dict[int, int]:
    """Remove the photos that fewer than LEAST_TIES points tie to the largest group of photos, in place.

    Such photos can lie anywhere: too little says how large and how far away their part is. Returns the index of each
    and the number of points.
    """
    out: dict[int, int] = {}
    while True:  # without some photos, others may hang by less
        model = model_from_reconstruction(best)
        group, ties = group_images(model, LEAST_TIES)
        if not ties.size or len(ties) == 1:
            return out
        main = int(np.bincount(group).argmax())
        loose = {name: int(ties[g, main]) for name, g in zip(model.names, group, strict=True) if g != main}
        for number in [i for i in best.reg_image_ids() if best.images[i].name in loose]:
            out[number - 1] = loose[best.images[number].name]
            best.deregister_frame(best.images[number].frame_id)


def explain_left_out(
    photos: list[SfmPhoto],
    placed: set[int],
    pairs: list[tuple[int, int, int]],
    loose: Mapping[int, int] = MappingProxyType({}),
) -> tuple[tuple[tuple[str, str], ...], int]:
    """Names of the photos that found no place, with the reason; and how many of them match a placed photo well.

    loose: of photos whose place was given up, the points that tie them to the others.
    """
    most = defaultdict(int)  # points shared with a placed photo
    for one, two, inliers in pairs:
        for index, other in ((one, two), (two, one)):
            if other in placed and index not in placed:
                most[index] = max(most[index], inliers)
    out = []
    for index, photo in enumerate(photos):
        if index in placed:
            continue
        reason = "it matches no photo that could be placed"
        if index in loose:
            reason = f"only {loose[index]} points tie it to the other photos; take photos between them and it"
        elif most[index]:
            reason = f"it shares {most[index]} points with a placed photo, but its position stays unsure"
        out.append((photo.path.name, reason))
    return tuple(out), sum(count >= LEAST_INLIERS for count in most.values())


def _run_mapping(approach: Approach, scene: SfmScene, seed: int) -> list[pycolmap.Reconstruction]:
    """The models that the photos give, of any number of photos.

    If only some cameras have a known focal length, those stay as they are until the end.
    """
    database, scratch, held = scene.database, scene.database.parent, scene.held
    if approach.mapper == "global":
        return _map_globally(bool(held), database, scratch, seed)
    with closing(pycolmap.Database.open(database)) as store:
        mixed = 0 < len(held) < store.num_cameras()
        count = store.num_images()
    choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=seed, max_num_models=3)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = choice.triangulation.random_seed = seed
    if held and not mixed:
        choice.ba_refine_focal_length = choice.mapper.abs_pose_refine_focal_length = False
    if mixed:
        choice.constant_cameras = set(held)
    with progress(range(count), "place photos") as bar:

        def report() -> None:
            bar.update(int(bar.n < count))  # COLMAP counts a photo again that it tries to place again

        found = run_cancellable(
            lambda token: pycolmap.incremental_mapping(
                database, scratch, scratch, choice, next_image_callback=report, cancellation_token=token
            )
        )
    if mixed:
        for reconstruction in found.values():
            bundle_adjust(reconstruction, refine_focal_length=False)
    return list(found.values())


def _map_globally(known: bool, database: Path, scratch: Path, seed: int) -> list[pycolmap.Reconstruction]:
    """All photos at once. known: EXIF has focal lengths."""
    choice = pycolmap.GlobalPipelineOptions(num_threads=1, random_seed=seed)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = seed
    for part in (choice.mapper.rotation_averaging, choice.mapper.global_positioning):
        part.random_seed = seed
    choice.mapper.global_positioning.use_gpu = False
    adjustment = choice.mapper.bundle_adjustment
    adjustment.refine_focal_length = not known
    adjustment.ceres.use_gpu = False
    adjustment.ceres.solver_options.num_threads = 1
    return list(pycolmap.global_mapping(database, scratch, scratch, choice).values())


def settle_focal_length(
    best: pycolmap.Reconstruction, held: dict[int, float], rng: np.random.Generator, hold: bool = False
) -> tuple[pycolmap.Reconstruction, FocalLength]:
    """The reconstruction with its settled focal length. held: EXIF's by camera, kept so far. hold: it stays.

    Raises: InputError: a solution that no lens gives.
    """
    normal, _, _ = fit_plane(np.array([p.xyz for p in best.points3D.values()]), rng)
    forward = np.stack([best.images[i].cam_from_world().rotation.matrix()[2] for i in best.reg_image_ids()])
    tilts = np.degrees(np.arccos(np.clip(np.abs(forward @ normal), 0, 1)))  # of the views off the ground's normal
    oblique = int((tilts > OBLIQUE).sum())
    fixes = oblique >= LEAST_OBLIQUE and oblique >= LEAST_SHARE * len(tilts)
    used = [c for c in best.cameras if any(best.images[i].camera_id == c for i in best.reg_image_ids())]
    exif = [held[c] for c in used if c in held]
    free = None
    if exif:
        free = pycolmap.Reconstruction(best)
        bundle_adjust(free, refine_focal_length=True)
        ratio = float(np.median([free.cameras[c].focal_length / held[c] for c in used if c in held]))
        near = abs(ratio - 1) <= HELD
        if hold and not near:
            decision = f"EXIF's, held: the photos alone would say {ratio:.3f} times that, which led to a model in doubt"
        elif fixes and not hold:
            decision = f"taken from the photos, {oblique} of which look at the ground from the side"
        elif near:
            decision = "EXIF's, which the photos confirm"
        else:
            decision = f"EXIF's: the photos alone would say {ratio:.3f} times that, but look too straight down to know"
        if fixes and not hold:
            best = free
    else:
        decision = "found by the photos alone: no EXIF says it"
        if not fixes:
            decision += ", and they look too straight down to know it well: heights may be too great or too small"
    for camera in (best.cameras[number] for number in used):
        sides = camera.focal_length / max(camera.width, camera.height)
        if not LENSES[0] <= sides <= LENSES[1]:
            raise InputError(
                f"the photos lead to a focal length of {sides:.2f} picture widths, which no usual lens has: they do "
                "not fix it; add photos that look from the side, or give the scene's `focal` in the config"
            )
    return best, FocalLength(
        float(np.median(exif)) if exif else None,
        float(np.median([best.cameras[c].focal_length for c in used])),
        float(np.median([free.cameras[c].focal_length for c in used])) if free else None,
        float(np.percentile(tilts, 95)),
        decision,
    )
