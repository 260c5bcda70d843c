"""From the start views to the coarse field, and from a field and new photos to the next one (the paper's UPDATE_GS)."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt import field as fields
from dav_gswt.coarse import discs, exposure, ground
from dav_gswt.coarse.doubt import with_uncertainty
from dav_gswt.coarse.fit import fit
from dav_gswt.coarse.ground import Ground
from dav_gswt.field import Field
from dav_gswt.views import View, over_ground

_log = logging.getLogger(__name__)

BAND = 0.1  # flying heights that things may stand above the ground
MARGIN = 0.15  # ground modelled around the exemplar, as a share of its side
BLOCK = 32  # the exemplar's side is a multiple of it, in cells: six levels halve it five times
GROUND_SHARE = 0.9  # of the cap that discs may take; things get the rest


@dataclass(frozen=True)
class Quality:
    """A named set of settings that trade speed for accuracy (config: qualities)."""

    size: int  # longer side of the photos, pixels
    spacing: float  # of the discs, in sizes of a photo's pixel on the ground
    cap: int  # most Gaussians
    steps: int  # of the coarse fit
    steps_per_photo: int  # of an update, for every new photo
    level_steps: int  # of the fit of a coarser level


def coarse(
    frame: dict,
    views: list[View],
    points: Float[Array, "n 3"],
    colours: Float[Array, "n 3"],
    quality: Quality,
    rng: np.random.Generator,
) -> tuple[Field, Ground]:
    """A field of the ground and the things on it, fitted to the start views.

    points, colours: of structure from motion, from these views alone. Exposures are levelled where the photos are real.
    """
    height = frame["flying_height"]
    pixel = min(height / view.camera.fx for view in views)
    grid = ground.lay(frame, points, quality.spacing * pixel, int(GROUND_SHARE * quality.cap), BLOCK, MARGIN)
    if frame["kind"] == "photos":
        views = exposure.levelled(views, _spread(grid))
    colour, known = discs.median_colours(grid.centres, views)
    grid = replace(grid, seen=known.reshape(grid.shape))
    base = discs.ground_discs(grid, discs.filled(colour, grid.seen))
    stand = discs.things(grid, points, colours, BAND * height)
    stand = stand[: max(0, quality.cap - len(base))]
    _log.info(
        "ground: %d x %d discs of %.4g %s, %.0f %% seen; %d things",
        *grid.shape,
        grid.spacing,
        frame["unit"],
        100 * grid.seen.mean(),
        len(stand),
    )
    start = fields.joined([base, stand])
    masked = modelled(views, grid)
    field = fit(start, grid, masked, quality.steps, BAND * height, rng, "fit coarse field")
    return with_uncertainty(field, masked), surface_of(field, grid)


def update(
    field: Field,
    grid: Ground,
    frame: dict,
    before: list[View],
    new: list[View],
    quality: Quality,
    rng: np.random.Generator,
) -> tuple[Field, Ground]:
    """The field refined with new photos: ground that only they see is coloured by them, then all is fitted on.

    Steps are bounded: steps_per_photo for each new one. Without new photos the field is handed on unchanged.
    """
    if not new:
        return field, grid
    views = before + new
    if frame["kind"] == "photos":
        views = exposure.levelled(views, _spread(grid))
    colour, known = discs.median_colours(grid.centres, views)
    fresh = known & ~grid.seen.ravel()
    sh = field.sh.copy()
    sh[: len(fresh), :1][fresh] = fields.sh_of(colour[fresh])
    grid = replace(grid, seen=known.reshape(grid.shape))
    masked = modelled(views, grid)
    steps = quality.steps_per_photo * len(new)
    refined = fit(
        replace(field, sh=sh), grid, masked, steps, BAND * frame["flying_height"], rng, f"fit {len(new)} new photos"
    )
    return with_uncertainty(refined, masked), surface_of(refined, grid)


def modelled(views: list[View], grid: Ground) -> list[View]:
    """The views, counting only where they look at the grid."""
    rows, columns = grid.shape
    inset = 2 * grid.spacing
    east, north = grid.west + columns * grid.spacing, grid.south + rows * grid.spacing
    return [over_ground(v, grid.west + inset, grid.south + inset, east - inset, north - inset) for v in views]


def surface_of(field: Field, grid: Ground) -> Ground:
    """The grid with the heights that the fit gave its discs."""
    return replace(grid, heights=field.means[: grid.heights.size, 2].reshape(grid.shape).astype(float))


def _spread(grid: Ground, most: int = 20_000) -> Float[Array, "n 3"]:
    """Some cells' centres, evenly over the grid: enough to fit exposures by."""
    centres = grid.centres
    return centres[:: max(1, len(centres) // most)]
