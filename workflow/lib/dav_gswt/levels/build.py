"""One level from its finer neighbour: merged, then fitted to the neighbour's pictures from above and from the side."""

import logging
from pathlib import Path

import numpy as np

from dav_gswt import cameras, images, raster
from dav_gswt.cameras import Camera
from dav_gswt.coarse.build import modelled
from dav_gswt.coarse.doubt import arrays
from dav_gswt.coarse.ground import Ground
from dav_gswt.coarse.rules import OnGround
from dav_gswt.errors import InputError
from dav_gswt.field import Field
from dav_gswt.fitting import trainer
from dav_gswt.fitting.plan import Plan
from dav_gswt.levels.merge import halved
from dav_gswt.views import View

_log = logging.getLogger(__name__)

ELEVATIONS = (90.0, 60.0, 35.0)  # degrees: pictures the coarser level is fitted to
AROUND = 6  # azimuths of each elevation but the zenith's
CLEARANCE = 2.0  # discs that a thing may rise above the highest it starts from
PIXELS = 2.0  # of a picture for one coarse disc: at the distance where a level is used a disc is about a pixel wide


def coarser(
    field: Field, grid: Ground, steps: int, rng: np.random.Generator, keep: Path | None = None
) -> tuple[Field, Ground]:
    """The next level: half the resolution, about a quarter of the Gaussians, fitted for `steps` steps.

    Raises: InputError: the mean scale does not rise (a field of things alone that did not merge).
    """
    start, coarse = halved(field, grid)
    views = modelled(neighbour_views(field, coarse), coarse)
    stand = start[~start.ground]
    top = float((stand.means[:, 2] - coarse.height_at(stand.means)).max()) + CLEARANCE * coarse.spacing
    rules, plan = OnGround(coarse, np.full(coarse.shape, top)), Plan(steps, len(start))
    level = trainer.fit(start, views, plan, rules, rng, f"fit level of {len(start)} Gaussians", keep).field
    before, after = (float(np.exp(f.log_scales).mean()) for f in (field, level))
    if not after > before:
        raise InputError(f"levels: the mean scale does not rise ({before:.4g} to {after:.4g}); ask for fewer levels")
    _log.info("mean scale %.4g to %.4g, %d to %d Gaussians", before, after, len(field), len(level))
    return level, coarse


def neighbour_views(field: Field, coarse: Ground) -> list[View]:
    """Pictures of a field, PIXELS pixels a coarse disc, drawn at twice that and averaged so that they do not alias."""
    drawn, views = raster.Rasterizer(), []
    for number, camera in enumerate(_cameras(coarse)):
        fine = camera.resized(2 * camera.width, 2 * camera.height)
        seen = drawn.forward(**arrays(field), camera=fine)
        # what shines through is not the field's colour: divide it out
        colour = seen.colour / np.maximum(seen.alpha, 0.5)[..., None]
        image = images.resized(np.clip(colour, 0, 1).astype(np.float32), camera.width, camera.height)
        views.append(View(f"neighbour_{number}", camera, image, np.ones(image.shape[:2], np.float32)))
    return views


def _cameras(grid: Ground) -> list[Camera]:
    rows, columns = grid.shape
    width, height = columns * grid.spacing, rows * grid.spacing
    centre = np.array([grid.west + width / 2, grid.south + height / 2, float(grid.heights.mean())])
    side = int(np.clip(PIXELS * max(rows, columns), 64, 1024))
    fov = 40.0
    radius = 0.6 * max(width, height) / np.tan(np.radians(fov / 2))
    found = []
    for elevation in ELEVATIONS:
        for step in range(1 if elevation == 90.0 else AROUND):
            azimuth = np.radians(360 / AROUND * (step + 0.5 * (elevation < 50)))
            e = np.radians(elevation)
            away = radius * np.array([np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e)])
            found.append(cameras.pinhole(centre + away, centre, side, side, fov))
    return found
