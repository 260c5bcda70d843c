"""Choice of the focal length of a photo set: that of EXIF, or the one that bundle adjustment finds.

Photos of flat ground from straight above hardly determine it: a longer lens higher up gives the same pictures, and
every photo registers with either. So EXIF's focal length is kept there. Oblique photos determine it, and then the
adjusted one is taken.
"""

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength
from dav_gswt.photos.colmap_model import bundle_adjust
from dav_gswt.photos.planes import fit_plane

OBLIQUE = 20.0  # degrees off the vertical from which a view helps to fix the focal length
LEAST_OBLIQUE = 3  # such views, and
LEAST_SHARE = 0.15  # of all
HELD = 0.03  # an adjusted focal length this close to EXIF's is taken as well
LENSES = 0.35, 6.0  # focal length in longer sides of the picture: a fisheye's to a long telescope's
LEAST_ANGLE = 2.0  # degrees, median over the points of the widest angle under which photos see them


def settle_focal_length(
    best: pycolmap.Reconstruction, held: dict[int, float], rng: np.random.Generator, hold: bool = False
) -> FocalLength:
    """Settle the focal length of a reconstruction, in place. held: EXIF's by camera, kept so far. hold: it stays.

    Raises: InputError: a solution that no lens gives, or photos from one spot.
    """
    tilts = _measure_tilts(best, rng)
    oblique = int((tilts > OBLIQUE).sum())
    fixes = oblique >= LEAST_OBLIQUE and oblique >= LEAST_SHARE * len(tilts)
    tilt = float(np.percentile(tilts, 95))
    used = [c for c in best.cameras if any(best.images[i].camera_id == c for i in best.reg_image_ids())]
    exif = [held[c] for c in used if c in held]
    free = _free_focal_lengths(best) if exif else None
    if free:
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
            _take_over(best, free)
    else:
        decision = "found by the photos alone: no EXIF says it"
        if not fixes:
            decision += ", and they look too straight down to know it well: heights may be too great or too small"
    _refuse_absurd(best, used)
    return FocalLength(
        float(np.median(exif)) if exif else None,
        float(np.median([best.cameras[c].focal_length for c in used])),
        float(np.median([free.cameras[c].focal_length for c in used])) if free else None,
        tilt,
        decision,
    )


def require_parallax(spread: Float[Array, "n"]) -> None:
    """spread: 1 - cos of the angle under which each point is seen. Raises: InputError: photos without parallax."""
    if len(spread) and np.degrees(np.arccos(1 - np.clip(np.median(spread), 0, 2))) < LEAST_ANGLE:
        raise InputError(
            "the photos were taken from nearly one spot: nothing can be said of heights and distances; "
            "move between photos by a quarter of the height over the ground"
        )


def _measure_tilts(best: pycolmap.Reconstruction, rng: np.random.Generator) -> Float[Array, "n"]:
    """Degrees between each view and the normal of the points' plane."""
    points = np.array([p.xyz for p in best.points3D.values()])
    normal, _, _ = fit_plane(points, rng)
    forward = np.stack([best.images[i].cam_from_world().rotation.matrix()[2] for i in best.reg_image_ids()])
    return np.degrees(np.arccos(np.clip(np.abs(forward @ normal), 0, 1)))


def _free_focal_lengths(best: pycolmap.Reconstruction) -> pycolmap.Reconstruction:
    """A copy whose focal lengths are free."""
    copy = pycolmap.Reconstruction(best)
    bundle_adjust(copy, refine_focal_length=True)
    return copy


def _take_over(best: pycolmap.Reconstruction, free: pycolmap.Reconstruction) -> None:
    for number, camera in free.cameras.items():
        best.cameras[number].params = camera.params
    for number in best.reg_image_ids():
        best.frames[best.images[number].frame_id].rig_from_world = free.frames[
            free.images[number].frame_id
        ].rig_from_world
    for number, point in free.points3D.items():
        best.points3D[number].xyz = point.xyz


def _refuse_absurd(best: pycolmap.Reconstruction, used: list[int]) -> None:
    for number in used:
        camera = best.cameras[number]
        sides = camera.focal_length / max(camera.width, camera.height)
        if not LENSES[0] <= sides <= LENSES[1]:
            raise InputError(
                f"the photos lead to a focal length of {sides:.2f} picture widths, which no usual lens has: they do "
                "not fix it; add photos that look from the side, or give the scene's `focal` in the config"
            )
