"""What the photos show of a scene before any fit: exposure, moving objects, relief, colours of the ground, and sky."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground, one_by_one
from dav_gswt.reconstruction import distractors, objects, sky
from dav_gswt.reconstruction.fitting import exposure
from dav_gswt.reconstruction.fitting.photo_colours import median_colours
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.plane_sweep import Relief, sweep_heights

MIN_CEILING = 0.05  # flying heights above the surface that objects may reach though the sweep saw none
EXPOSURE_POINTS = 20_000  # ground points, at most, that photos' exposures are compared at


@dataclass(frozen=True)
class Observation:
    """views: the photos at one exposure, without moving objects. relief: what rises above the ground."""

    views: list[TrainingView]
    relief: Relief


def pixel_size(frame: SceneFrame, views: list[TrainingView]) -> float:
    """Size on the ground of the finest photo's pixel."""
    return min(frame.flying_height / view.camera.fx for view in views)


def observe(frame: SceneFrame, grid: Ground, views: list[TrainingView]) -> Observation:
    """Equalize the photos' exposure, sweep the relief, and mask what moves; synthetic photos need only the sweep."""
    if frame.kind == "photos":
        views = exposure.equalize_exposure(views, thin_places(grid.centres))
    relief = sweep_heights(grid, views, frame.flying_height, pixel_size(frame, views))
    if frame.kind == "photos":
        open_ground = ~(relief.onto(grid, relief.stands.astype(float)) > 0.1)
        views = distractors.mask_distractors(views, grid.centres[open_ground.ravel()], grid.spacing)
    return Observation(views, relief)


def thin_places(places: Float[Array, "n 3"]) -> Float[Array, "m 3"]:
    """Some EXPOSURE_POINTS of the places at most, evenly, which exposures are compared at."""
    return places[:: max(1, len(places) // EXPOSURE_POINTS)]


def ground_colours(
    grid: Ground, views: list[TrainingView], occluders: GaussianField
) -> tuple[Float[Array, "n 3"], Bool[Array, "r c"]]:
    """Median colours of the ground's cells, and which cells a photo sees that no object hides."""
    if len(occluders):
        rasterizer = raster.Rasterizer()
        arrays = raster.to_raster_arrays(occluders)
        clear = (rasterizer.forward(**arrays, camera=view.camera).alpha < 0.5 for view in views)
        views = [view.with_pixels(weight=view.weight * c) for view, c in zip(one_by_one(views), clear, strict=True)]
    colour, known = median_colours(grid.centres, views)
    return colour, known.reshape(grid.shape)


def make_constraints(grid: Ground, relief: Relief, occluders: GaussianField, frame: SceneFrame) -> GroundConstraints:
    """The constraints of a fit over this ground: how high objects may be, by cell."""
    ceiling = np.maximum(objects.compute_ceiling(grid, relief, occluders), MIN_CEILING * frame.flying_height)
    return GroundConstraints(grid, ceiling)


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


def extent_of(points: Float[Array, "n 3"]) -> float:
    """Diagonal of the box that holds the middle 90 % of the points along each axis."""
    return float(np.linalg.norm(np.percentile(points, 95, axis=0) - np.percentile(points, 5, axis=0)))
