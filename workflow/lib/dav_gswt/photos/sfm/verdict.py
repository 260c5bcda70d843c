"""Verdict on a model of structure from motion, from several signs together: good, doubtful or refused.

Every photo can be registered in a model that is nonsense, and no single number shows it. Each sign is graded by itself;
two signs, one of them refused, or three doubts refuse the model.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import Grade, SfmSign, SfmVerdict
from dav_gswt.photos.colmap_model import ColmapModel, group_images
from dav_gswt.photos.ground_frame import PHOTOGRAPH_GROUND, fit_plane, make_upright_rotation
from dav_gswt.photos.sfm.gps import ACROSS, LEAST_SPREAD, WORST, fit_similarity, measure_spread

LEAST_TIES = 15  # points that must tie photos to the others, or they are left out
WELL_TIED = 40  # points; parts with fewer are named
# Of each sign the values beyond which it is doubtful, and beyond which refused.
THRESHOLDS = {
    "reprojection error": (0.9, 2.0),  # pixels; good sets have 0.18 to 0.57, one of fog had 1.39
    "track length": (1 / 2.6, 1 / 2.2),  # 1 / photos a point; points by chance have two, others three or more
    "GPS": (0.5, 0.7),  # of the flight's extent; receivers that lag have 0.35, positions by chance 0.8
    "ground": (30.0, 50.0),  # degrees between the ground's normal and the vertical; slopes stay below 30
    "tilt": (75.0, 85.0),  # degrees off the vertical, median; ground seen so flat fills no square
    "focal length": (1.25, 1.6),  # times EXIF's or its inverse; from above, free estimates end up to 1.15 off
    "roughness": (0.04, 0.1),  # of the distance, between points side by side in a photo; fog has no surface
    "relief": (0.2, 1 / 3),  # of the flying height; above a third no plane is a ground
    "hangs together": (1 / WELL_TIED, 1 / LEAST_TIES),  # 1 / points that tie a part to the rest; good sets have 120
    "placed": (0.5, 0.9),  # of the photos that found no place; then the set is not what was meant
}
SIDEWAYS = (60.0, 60.0)  # degrees, of uneven points: things on a table and rooms, which are seen from the side
ALONE = ("reprojection error",)  # refused, it refuses the model by itself
FAR = 10 * ACROSS  # metres: no receiver is so wrong, however long the flight
SHAPE = {"tilt", "relief", "roughness", "ground", "placed"}  # a model that fails by these alone is right, but no ground
COVERAGE = ("placed",)  # signs about what is missing: they contradict nothing
NEIGHBOURS = 6  # points beside a point in a photo
LEAST_INLIERS = 30  # matches that hold two photos together; mapping needs as many
FEW = 5  # photos; in smaller sets tracks are short anyway


def judge_model(
    model: ColmapModel,
    rng: np.random.Generator,
    error: float,
    images: int,
    focal_ratio: float | None = None,
    positions: Float[Array, "n 3"] | None = None,
) -> SfmVerdict:
    """The verdict on a model, its world frame being any, by what is known beside it.

    error: mean reprojection error at the size of features, pixels. images: of the set. focal_ratio: the freely adjusted
    focal length over EXIF's. positions: by GPS, of the model's images, metres east, north and up; NaN where a photo has
    none.
    """
    normal, offset, spread = fit_plane(model.points, rng)
    signs: list[SfmSign | None] = [_grade("reprojection error", error, f"points are off by {describe_error(error)}")]
    if len(model.names) >= FEW and len(model.points):
        length = len(model.pixels) / len(model.points)
        signs.append(_grade("track length", 1 / length, f"a point is seen by {length:.1f} photos on average"))
    turn, gps = _judge_gps(model, positions, normal)
    signs.append(gps)
    heights = np.array([camera.centre @ normal for camera in model.cameras]) - offset
    relief = spread / max(abs(float(np.median(heights))), 1e-12)
    uneven = _grade("relief", relief, f"points lie {relief:.2f} camera heights off their plane")
    tilt = float(np.median([_measure_angle(camera.forward, normal) for camera in model.cameras]))
    limits = SIDEWAYS if uneven.grade != "good" else THRESHOLDS["tilt"]
    signs.append(_grade("tilt", tilt, f"photos look {tilt:.0f} degrees off the ground's vertical (median)", limits))
    if turn is not None:
        angle = _measure_angle(turn[2], normal)
        signs.append(_grade("ground", angle, f"the ground lies {angle:.0f} degrees from level, as GPS says it"))
    if focal_ratio:
        reason = f"the photos alone say {focal_ratio:.2f} times the focal length of EXIF"
        signs.append(_grade("focal length", max(focal_ratio, 1 / focal_ratio), reason))
    signs.append(_judge_roughness(model))
    signs.append(uneven)
    signs.append(_judge_ties(model))
    placed = len(model.names)
    signs.append(_grade("placed", 1 - placed / images, f"{placed} of {images} photos found a place"))
    known = tuple(sign for sign in signs if sign)
    return SfmVerdict(combine_grades(known), known)


def describe_error(error: float) -> str:
    """A mean reprojection error in pixels, beside the largest good one."""
    return f"{error:.2f} px on average (good: up to {THRESHOLDS['reprojection error'][0]})"


def combine_grades(signs: Iterable[SfmSign]) -> Grade:
    """Refused: by two signs one of which is refused, by three doubts, or by one sign that is enough alone."""
    bad = [sign for sign in signs if sign.grade != "good"]
    against = [sign for sign in bad if sign.name not in COVERAGE]
    refused = [sign for sign in against if sign.grade == "refused"]
    if len(against) >= 3 or (refused and len(against) >= 2) or any(sign.name in ALONE for sign in refused):
        return "refused"
    return "doubtful" if bad else "good"


def _grade(name: str, value: float, reason: str, limits: tuple[float, float] | None = None) -> SfmSign:
    """limits: in place of those of THRESHOLDS."""
    doubtful, refused = limits or THRESHOLDS[name]
    grade = "refused" if value > refused else "doubtful" if not value <= doubtful else "good"
    return SfmSign(name, grade, reason)


def _judge_gps(
    model: ColmapModel, positions: Float[Array, "n 3"] | None, normal: Float[Array, "3"]
) -> tuple[Float[Array, "3 3"] | None, SfmSign | None]:
    """The rotation into the frame of the GPS positions, where they agree with the model, and the sign.

    Positions on one line say no rotation, and within the error of receivers nothing.
    The sign looks at distances along the ground: altitudes drift by tens of metres in flights that are else right.
    """
    known = np.isfinite(positions).all(1) if positions is not None else np.zeros(0, bool)
    if positions is None or known.sum() < 4:
        return None, None
    centres, at = np.stack([camera.centre for camera in model.cameras])[known], positions[known]
    extent, says_up = measure_spread(at)
    if extent < LEAST_SPREAD * ACROSS:
        return None, None
    _, turn, _, off = fit_similarity(centres, at)
    flat = np.array([1.0, 1.0, 0.0])
    east = np.eye(3)[np.abs(normal).argmin()]
    _, _, _, across = fit_similarity(centres @ make_upright_rotation(normal, east).T * flat, at * flat)
    reason = (
        f"cameras lie {across:.1f} m from their GPS positions (median), {across / extent:.0%} of the flight's extent"
    )
    if across <= WORST * ACROSS:  # within the error of receivers, also of a small flight
        sign = SfmSign("GPS", "good", reason)
    else:
        sign = _grade("GPS", across / extent, reason)
        if sign.grade == "good" and across > FAR:
            sign = SfmSign("GPS", "doubtful", reason)
    return (turn if off <= WORST * ACROSS and says_up else None), sign


def _measure_angle(one: Float[Array, "3"], other: Float[Array, "3"]) -> float:
    """Degrees between two lines along unit vectors."""
    return float(np.degrees(np.arccos(np.clip(abs(one @ other), 0, 1))))


def _judge_roughness(model: ColmapModel) -> SfmSign | None:
    """How much the distance changes between points that are neighbours in a photo, over the distance; median."""
    found = []
    for i, camera in enumerate(model.cameras):
        own = np.flatnonzero(model.image_of == i)
        if len(own) <= NEIGHBOURS:
            continue
        _, depth = camera.project(model.points[model.point_of[own]])
        near = np.asarray(cKDTree(model.pixels[own]).query(model.pixels[own], k=NEIGHBOURS + 1)[1])
        beside = np.median(np.abs(depth[near[:, 1:]] - depth[:, None]), axis=1)
        found.append(beside / np.maximum(np.abs(depth), 1e-12))
    if not found:
        return None
    value = float(np.median(np.concatenate(found)))
    return _grade(
        "roughness", value, f"points side by side in a photo differ by {value:.1%} of their distance (median)"
    )


def _judge_ties(model: ColmapModel) -> SfmSign:
    """By how many points the part of the model hangs on the rest that is tied to it least."""
    group, _ = group_images(model, WELL_TIED)
    main, n = np.bincount(group).argmax(), len(model.points)
    most = {}
    for part in np.setdiff1d(group, main).tolist():
        inside = group[model.image_of] == part
        seen = [np.bincount(model.point_of[own], minlength=n) for own in (inside, ~inside)]
        most[part] = int(((seen[0] > 0) & (seen[1] > 0) & (seen[0] + seen[1] >= 3)).sum())
    if not most:
        return _grade("hangs together", 1 / WELL_TIED, f"{WELL_TIED} points or more tie each photo to the others")
    worst = min(most, key=lambda g: (most[g], g))
    names = [name.removesuffix(".png") for name, g in zip(model.names, group, strict=True) if g == worst]
    some = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
    reason = f"only {most[worst]} points tie {some} to the other photos"
    return _grade("hangs together", 1 / max(most[worst], 1e-12), reason)


def require_trust(verdict: SfmVerdict) -> None:
    """Raises: InputError: the verdict is refused; the message has its reasons and what was tried."""
    if verdict.grade != "refused":
        return
    reasons = "; ".join(sign.reason for sign in verdict.objections)
    names = {sign.name for sign in verdict.objections}
    if names & {"tilt", "relief"} and names <= SHAPE:
        raise InputError(f"the photos show no ground: {reasons}. {PHOTOGRAPH_GROUND}")
    tried = f" ({len(verdict.tried)} ways were tried; the log has what each gave)" if len(verdict.tried) > 1 else ""
    indoors = f". If they show a room or a table: {PHOTOGRAPH_GROUND}" if {"tilt", "relief"} <= names else ""
    raise InputError(
        f"the photos do not fit together to one scene: {reasons}{tried}. Take photos that overlap more and show "
        f"texture, give the scene's `focal` if EXIF is wrong, or remove GPS from the photos if it is wrong{indoors}"
    )
