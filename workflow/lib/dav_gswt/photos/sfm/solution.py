"""The ways in which photos are mapped, what is thought of each model, and which is taken."""

import logging
from collections import defaultdict
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmVerdict
from dav_gswt.photos.colmap_model import model_from_reconstruction
from dav_gswt.photos.sfm.focal_length import settle_focal_length
from dav_gswt.photos.sfm.gps import GpsPositions
from dav_gswt.photos.sfm.mapping import (
    Approach,
    Mapper,
    list_alternatives,
    other_mapper,
    run_mapping,
    write_pose_priors,
)
from dav_gswt.photos.sfm.verdict import COVERAGE, LEAST_INLIERS, SfmEvidence, find_groups, judge_model

_log = logging.getLogger(__name__)

LEAST_PHOTOS = 3
UNSURE = 0.1  # share of the photos: so many left out, though they match placed ones, are tried with the other mapper
LEAST_PLACED = 0.8  # of the photos that the first way of mapping places: as many another must place


@dataclass(frozen=True)
class SfmPhoto:
    """A photo that structure from motion is given.

    key: name of the picture that is made of it. full: its size. width, height, focal: at the size at which features
    are looked for; focal is EXIF's.
    """

    path: Path
    key: str
    full: tuple[int, int]
    width: int
    height: int
    focal: float | None


@dataclass(frozen=True)
class SfmScene:
    """What mapping starts from.

    folder: of the photos. held: EXIF's focal lengths by camera. database: COLMAP's, of features and matches.
    """

    folder: Path | str
    photos: list[SfmPhoto]
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
class SfmSolution:
    """A model and what is thought of it. best: its focal length is settled. left_out: names and reasons.

    unsure: how many of those left out match a placed photo well.
    """

    best: pycolmap.Reconstruction
    left_out: tuple[tuple[str, str], ...]
    focal: FocalLength
    verdict: SfmVerdict
    unsure: int = 0


def find_solution(scene: SfmScene, mapper: Mapper, seed: int) -> SfmSolution:
    """Map the photos; in other ways as well where that fails, where the signs contradict the model, or where many
    photos are left out though they match others. The best by the signs, then by the photos that it places.

    Raises: InputError: of the first way, where none gives a model.
    """
    solved: list[SfmSolution] = []
    tried: list[str] = []

    def attempt(approach: Approach) -> InputError | None:
        try:
            solved.append(_solve(approach, scene, seed))
        except InputError as error:
            tried.append(f"{approach}: {error}")
            return error
        tried.append(_describe_try(approach, solved[-1].verdict))
        return None

    first = Approach(mapper)
    failure = attempt(first)
    for approach in _list_after_failure(first, scene) if failure else _list_other_ways(first, solved[0], scene):
        _log.info("try %s", approach)
        attempt(approach)
    if failure and not solved:
        raise failure
    least = LEAST_PLACED * solved[0].best.num_reg_images()
    enough = [solution for solution in solved if solution.best.num_reg_images() >= least]
    best = min(enough, key=lambda solution: (*_count_objections(solution.verdict), -solution.best.num_reg_images()))
    return replace(best, verdict=replace(best.verdict, tried=tuple(tried)))


def _list_other_ways(first: Approach, solution: SfmSolution, scene: SfmScene) -> list[Approach]:
    """Other ways of mapping that may give a better model than the first did."""
    against = [sign.reason for sign in solution.verdict.objections if sign.name not in COVERAGE]
    if against:
        _log.info("the model may be wrong: %s", against[0])
        ratio = solution.focal.ratio
        freed = ratio is not None and not np.isclose(ratio, 1, rtol=1e-9)
        return list_alternatives(first, freed, scene.positions is not None)
    if solution.unsure and solution.unsure >= UNSURE * len(scene.photos):
        _log.info("photos without a place, though they match others: %d", solution.unsure)
        return [Approach(other_mapper(first.mapper))]
    return []


def _list_after_failure(first: Approach, scene: SfmScene) -> list[Approach]:
    """Ways of mapping that may give a model where the first gave none; none where no photos match each other."""
    if not any(inliers >= LEAST_INLIERS for *_, inliers in _read_pairs(scene.database)):
        return []
    return list_alternatives(first, bool(scene.held), scene.positions is not None)


def _describe_try(approach: Approach, verdict: SfmVerdict) -> str:
    reasons = "; ".join(sign.reason for sign in verdict.objections)
    return f"{approach}: {verdict.grade}" + (f" ({reasons})" if reasons else "")


def _count_objections(verdict: SfmVerdict) -> tuple[int, int, int]:
    """The worse, the greater: the grade, then refused and all signs against the model."""
    refused = sum(sign.grade == "refused" for sign in verdict.objections)
    return ("good", "doubtful", "refused").index(verdict.grade), refused, len(verdict.objections)


def _solve(approach: Approach, scene: SfmScene, seed: int) -> SfmSolution:
    """Map in one way. Raises: InputError: too few photos found a place, or a focal length that no lens has."""
    photos, database = scene.photos, scene.database
    write_pose_priors(database, scene.gps if approach.use_gps else {})
    found = run_mapping(approach, database, database.parent, scene.held, seed)
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
    settled = settle_focal_length(best, scene.held, np.random.default_rng(seed), approach.hold_focal)
    model = model_from_reconstruction(best)
    gps = scene.gps
    evidence = SfmEvidence(
        error=float(best.compute_mean_reprojection_error()),
        images=len(photos),
        focal_ratio=settled.free / settled.exif if settled.free and settled.exif else None,
        positions=np.stack([gps[name] for name in model.names]) if gps else None,
        groups=find_groups([photo.path.name for photo in photos], pairs, [i - 1 for i in best.reg_image_ids()]),
    )
    verdict = judge_model(model, evidence, np.random.default_rng(seed))
    return SfmSolution(best, left_out, settled, verdict, sum(count >= LEAST_INLIERS for count in shared.values()))


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


def _left_out(photos: list[SfmPhoto], best: pycolmap.Reconstruction | None, shared: dict[int, int]) -> tuple:
    """Names of the photos that found no place, with the reason."""
    placed = {number - 1 for number in best.reg_image_ids()} if best else set()
    out = []
    for index, photo in enumerate(photos):
        if index not in placed:
            most = shared.get(index, 0)
            unsure = f"it shares {most} points with a placed photo, but its position stays unsure"
            out.append((photo.path.name, unsure if most else "it matches no photo that could be placed"))
    return tuple(out)
