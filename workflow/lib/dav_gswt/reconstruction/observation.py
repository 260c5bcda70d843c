"""What the photos show of a scene before any fit: exposure, moving objects, relief, colours of the ground, and sky."""

import logging
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import maximum_filter

from dav_gswt import raster
from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground, one_by_one
from dav_gswt.reconstruction import objects, sky
from dav_gswt.reconstruction.fitting import exposure
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.photo_colours import chunk_points, median_colours, nan_median, sample_all_views
from dav_gswt.reconstruction.plane_sweep import Relief, sweep_heights

_log = logging.getLogger(__name__)

MIN_CEILING = 0.05  # flying heights above the surface that objects may reach though the sweep saw none
EXPOSURE_POINTS = 20_000  # ground points, at about most, evenly, that photos' exposures are compared at
MIN_PHOTOS = 4  # that see a point, to tell a moving object (a kite's line, a shadow, a person) in one of them
MAX_DEVIATIONS = 6.0  # median deviations from the median
MIN_DIFFERENCE = 0.12  # of the range of colours
NOTABLE_SHARE = 0.2  # of a photo's pixels, beyond which the log warns: a large shadow, or a wrong place


def pixel_size(frame: SceneFrame, views: list[TrainingView]) -> float:
    """Size on the ground of the finest photo's pixel."""
    return min(frame.flying_height / view.camera.fx for view in views)


def observe(frame: SceneFrame, grid: Ground, views: list[TrainingView]) -> tuple[list[TrainingView], Relief]:
    """Equalize the photos' exposure, sweep the relief, and mask what moves; synthetic photos need only the sweep.

    Returns: the photos at one exposure, without moving objects; what rises above the ground.
    """
    if frame.kind == "photos":
        places = grid.centres
        views = exposure.equalize_exposure(views, places[:: max(1, len(places) // EXPOSURE_POINTS)])
    relief = sweep_heights(grid, views, frame.flying_height, pixel_size(frame, views))
    if frame.kind == "photos":
        open_ground = ~(relief.onto(grid, relief.stands.astype(float)) > 0.1)
        views = mask_distractors(views, grid.centres[open_ground.ravel()], grid.spacing)
    return views, relief


def mask_distractors(views: list[TrainingView], points: Float[Array, "n 3"], spacing: float) -> list[TrainingView]:
    """The views with weight 0 where they disagree with the others on the surface's points, `spacing` apart.

    Where at least MIN_PHOTOS photos see a point and agree, a photo that differs far from their median shows a moving
    object. Points where all photos differ, as on a shrub, are kept.
    """
    masks = [np.zeros(v.image.shape[:2], bool) for v in views]
    reach = [1] * len(views)  # pixels around a point that are its own
    for part in chunk_points(points, views):
        seen = sample_all_views(part, views)
        for i, odd in enumerate(find_disagreeing(seen)):
            if odd.any():
                pixel, depth = views[i].camera.project(part[odd])
                masks[i][pixel[:, 1].astype(int), pixel[:, 0].astype(int)] = True
                wide = spacing * views[i].camera.fx / float(np.median(depth))
                reach[i] = max(reach[i], int(np.ceil(wide / 2)))
    out = []
    for view, mask, own in zip(one_by_one(views), masks, reach, strict=True):
        mask = maximum_filter(mask, 2 * own + 1, mode="constant") if mask.any() else mask
        share = float(mask.mean())
        if share > NOTABLE_SHARE:
            said = "%s differs from the other photos over %.0f %% of its pixels, which do not count"
            _log.warning(said, view.name, 100 * share)
        if share > 0:
            view = view.with_pixels(weight=view.weight * ~mask)
        out.append(view)
    return out


def find_disagreeing(seen: Float[Array, "v n 3"]) -> Bool[Array, "v n"]:
    """Which samples differ far from the median of their point, where the others agree."""
    count = np.isfinite(seen[..., 0]).sum(0)
    apart = np.abs(seen - nan_median(seen)).max(-1)
    spread = nan_median(apart[..., None])[:, 0]
    with np.errstate(invalid="ignore"):
        return (count >= MIN_PHOTOS) & (apart > np.maximum(MAX_DEVIATIONS * spread, MIN_DIFFERENCE))


def ground_colours(
    grid: Ground, views: list[TrainingView], occluders: GaussianField
) -> tuple[Float[Array, "n 3"], Bool[Array, "r c"]]:
    """Median colours of the ground's cells, and which cells a photo sees that no object hides."""
    if len(occluders):
        rasterizer = raster.make_rasterizer()
        pictures = rasterizer.forward_each(raster.to_raster_arrays(occluders), [view.camera for view in views])
        clear = (seen.alpha < 0.5 for seen in pictures)
        views = [view.with_pixels(weight=view.weight * c) for view, c in zip(one_by_one(views), clear, strict=True)]
    colour, known = median_colours(grid.centres, views)
    return colour, known.reshape(grid.shape)


def make_constraints(
    grid: Ground, relief: Relief, occluders: GaussianField, frame: SceneFrame, **options: Any
) -> GroundConstraints:
    """The constraints of a fit over this ground: how high objects may be, by cell. options: of `GroundConstraints`."""
    ceiling = np.maximum(objects.compute_ceiling(grid, relief, occluders), MIN_CEILING * frame.flying_height)
    return GroundConstraints(grid, ceiling, **options)


def mask_to_ground(views: list[TrainingView], grid: Ground) -> list[TrainingView]:
    """The views, counting only where they look at the grid."""
    rows, columns = grid.shape
    inset = 2 * grid.spacing
    east, north = grid.west + columns * grid.spacing, grid.south + rows * grid.spacing
    return [
        mask_outside_ground(v, grid.west + inset, grid.south + inset, east - inset, north - inset)
        for v in one_by_one(views)
    ]


def mask_for_fit(views: list[TrainingView], grid: Ground) -> list[TrainingView]:
    """The views as a fit takes them: counting over the grid, and where they see the sky behind it."""
    return sky.add_sky(views, mask_to_ground(views, grid))


def thin_at_random(part: GaussianField, room: int, rng: np.random.Generator) -> GaussianField:
    """At most `room` Gaussians, sampled at random, so that objects get thinner everywhere."""
    if len(part) <= room:
        return part
    return part[np.sort(rng.choice(len(part), max(0, room), replace=False))]
