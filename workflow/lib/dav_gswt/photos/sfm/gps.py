"""GPS positions of photos: they give a registered photo set its metres and its north.

Receivers in cameras lag and drift. A robust similarity aligns the cameras with the positions; where the residuals
exceed the error of receivers, the positions are not used. Otherwise they are priors of the last bundle adjustment.
A geo.txt beside the photos, as OpenDroneMap reads it, counts before their EXIF.
"""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos.colmap_model import ColmapModel, bundle_adjust, model_from_reconstruction
from dav_gswt.photos.geo_file import read_geo_files
from dav_gswt.photos.ground_frame import fit_plane, make_upright_rotation
from dav_gswt.photos.photo_files import read_gps_position

_log = logging.getLogger(__name__)

ACROSS, UP = 3.0, 6.0  # metres: standard deviation of a receiver's position, along the ground and in height
LEAST_SHARE = 0.8  # of the photos that must have a position, or none counts
LEAST_SPREAD = 4.0  # positions must spread this many ACROSS, or they say neither scale nor north
LEAST_WIDTH = 3.0  # and this many across their own line, or they do not say where up is
WORST = 2.0  # ACROSS: median distance from the cameras at which the positions contradict the photos
ROUNDS = 50  # of reweighting


@dataclass(frozen=True)
class GpsPositions:
    """Where photos were taken. about: the place of a frame of metres east, north and up; its own north is 0.

    at: in that frame, by photo; NaN where a photo does not say. Where altitudes are not known all of them are NaN, and
    the altitude of `about` is 0: the ground's, as `fill_altitudes` has it.
    """

    about: Georeference
    at: Float[Array, "n 3"]


def read_gps_positions(paths: list[Path]) -> GpsPositions | None:
    """The positions of a set's photos; None, with the reason in the log, where they cannot place it."""
    listed = read_geo_files(paths)
    found = np.array([listed.get(path) or read_gps_position(path) or (np.nan,) * 3 for path in paths], float)
    placed = np.isfinite(found[:, :2]).all(1)
    if not placed.any():
        return None
    if placed.mean() < LEAST_SHARE:
        _log.warning("only %d of %d photos have a GPS position: none is used", placed.sum(), len(paths))
        return None
    known = np.isfinite(found).all(1)
    if level := bool(known.mean() < LEAST_SHARE):
        _log.info("GPS: %d of %d photos have no altitude: the model gives it", len(paths) - known.sum(), len(paths))
        known, found[:, 2] = placed, 0.0
    about = Georeference(*map(float, np.median(found[known], axis=0)), north=0.0, metres_per_unit=1.0)
    at = np.full(found.shape, np.nan)
    at[known] = about.to_world(found[known])
    spread, _ = measure_spread(at[known])
    if spread < LEAST_SPREAD * ACROSS:
        _log.warning("the photos' GPS positions lie within %.0f m, which is within their error: none is used", spread)
        return None
    if level:
        at[:, 2] = np.nan
    return GpsPositions(about, at)


def measure_spread(at: Float[Array, "n 3"]) -> tuple[float, bool]:
    """Metres: the standard deviation of positions along the ground; and whether they say where up is.

    They do not along a straight line: the rotation about it is then that of the receivers' errors. Heights count by as
    much less as they are less exact.
    """
    centred = (at - at.mean(0)) / np.sqrt(len(at))
    across = np.linalg.svd(centred * [1, 1, ACROSS / UP], compute_uv=False)[1]
    return float(np.linalg.norm(centred[:, :2])), bool(across >= LEAST_WIDTH * ACROSS)


def fill_altitudes(model: ColmapModel, at: Float[Array, "n 3"], rng: np.random.Generator) -> Float[Array, "n 3"]:
    """The positions of a model's images with the model's own altitudes over its ground, where no altitude is known.

    The model is levelled by the plane of its points; its scale and north are those that fit the positions in the plane.
    """
    known = np.isfinite(at[:, :2]).all(1)
    if known.sum() < 3 or np.isfinite(at[:, 2]).any():
        return at
    normal, offset, _ = fit_plane(model.points, rng)
    centres = np.stack([camera.centre for camera in model.cameras])
    heights = centres @ normal - offset
    if np.median(heights) < 0:
        normal, heights = -normal, -heights
    level = centres @ make_upright_rotation(normal, np.eye(3)[np.abs(normal).argmin()]).T
    scale, _, _, _ = fit_similarity(level[known, :2], at[known, :2])
    return np.c_[at[:, :2], scale * heights]


def align_to_gps(
    best: pycolmap.Reconstruction, at: dict[str, Float[Array, "3"]], seed: int = 0, adjust: bool = True
) -> bool:
    """Bring a reconstruction into the frame of the positions, in place, and adjust it with them as priors.

    at: the positions by the images' names; where they have no altitude the model's own is taken. adjust: False: the
    cameras are given and move as one. Returns whether the positions agree with the photos; if not, or if they lie on
    one line or within the error of receivers, nothing is changed.
    """
    model = model_from_reconstruction(best)
    filled = fill_altitudes(model, np.stack([at[name] for name in model.names]), np.random.default_rng(seed))
    at = dict(zip(model.names, filled, strict=True))
    numbers = [i for i in best.reg_image_ids() if np.isfinite(at[best.images[i].name]).all()]
    if len(numbers) < 3:
        return False
    centres = np.stack([best.images[i].projection_center() for i in numbers])
    positions = np.stack([at[best.images[i].name] for i in numbers])
    spread, says_up = measure_spread(positions)
    if spread < LEAST_SPREAD * ACROSS or not says_up:
        where = "on one line" if not says_up else f"within {spread:.0f} m"
        _log.warning("the GPS positions of the photos that found a place lie %s: unused", where)
        return False
    scale, turn, shift, off = fit_similarity(centres, positions)
    if off > WORST * ACROSS:
        _log.warning("the photos' GPS positions are %.0f m off where the photos themselves place them: unused", off)
        return False
    best.transform(pycolmap.Sim3d(scale, pycolmap.Rotation3d(turn), shift))
    _log.info("GPS: the photos lie in metres, %.1f m from their positions (median)", off)
    if not adjust:
        return True
    priors = [
        pycolmap.PosePrior(
            corr_data_id=best.images[i].data_id,
            position=position,
            position_covariance=np.diag([ACROSS**2, ACROSS**2, UP**2]),
            coordinate_system=pycolmap.PosePriorCoordinateSystem.CARTESIAN,
        )
        for i, position in zip(numbers, positions, strict=True)
    ]
    bundle_adjust(best, priors=priors)
    return True


def fit_similarity(
    a: Float[Array, "n d"], b: Float[Array, "n d"]
) -> tuple[float, Float[Array, "d d"], Float[Array, "d"], float]:
    """Scale s, rotation R and shift t of b = s R a + t, in two or three dimensions, and the median distance left.

    Umeyama's closed form under Geman-McClure weights at the scale of a receiver's error: lone outliers have no say.
    """
    count, size = a.shape
    weight, scale, turn, shift, off = np.ones(count), 1.0, np.eye(size), np.zeros(size), np.zeros(count)
    for _ in range(ROUNDS):
        w = weight / weight.sum()
        ma, mb = w @ a, w @ b
        u, s, vt = np.linalg.svd(((b - mb) * w[:, None]).T @ (a - ma))
        sign = np.array([*np.ones(size - 1), np.sign(np.linalg.det(u @ vt))])
        turn = u * sign @ vt
        scale = float((s * sign).sum() / max(w @ ((a - ma) ** 2).sum(1), 1e-300))
        shift = mb - scale * turn @ ma
        off = np.linalg.norm(scale * a @ turn.T + shift - b, axis=1)
        weight = (1 + (off / ACROSS) ** 2) ** -2
    return scale, turn, shift, float(np.median(off))
