"""Build the levels of detail of a field: each is its finer neighbour, merged and then fitted to pictures of it.

Pictures are rendered from above, from the side and at eye level. The fit changes colours, sizes and
objects. Ground discs keep the mean height of the cells they cover: fitted heights are rough, and at eye
level one disc hides the next.
"""

import logging
from dataclasses import replace

import numpy as np

from dav_gswt import raster
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.lod.merge import crop_to_blocks, halve_resolution
from dav_gswt.lod.store import AUTO, MAX_LEVELS, Levels
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import to_raster_arrays
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitPlan
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.observation import mask_to_ground

_log = logging.getLogger(__name__)

MIN_CELLS = 32  # cells across the exemplar, at least, of a level that is fitted; tiles merge coarser ones themselves
COVERED = 0.9  # opacity of a pixel that a coarser level is fitted to
MAX_SHARE = 0.5  # of a level's Gaussians that the next one may have at most
ELEVATIONS = (90.0, 50.0, 20.0, 6.0)  # degrees: pictures the coarser level is fitted to, down to eye level
AZIMUTHS = 6  # azimuths of each elevation but the zenith's
CLEARANCE = 2.0  # discs that an object may rise above its highest start
PIXELS_PER_DISC = 2.0  # of a coarse disc: where a level is used, a disc is about a pixel wide


def build_levels(field: GaussianField, grid: Ground, wanted: int | str, steps: int, seed: int) -> Levels:
    """Fit as many coarser levels as are wanted and as the exemplar has room for.

    Coarser levels are merged from each tile's own cells (`tiles.compose`), so a level is fitted only if it has at
    least MIN_CELLS cells across the exemplar. The first is always fitted: it gives every field a ground. With AUTO, a
    level that saves too few Gaussians is dropped.

    Args: wanted: number of levels, or AUTO. steps: of each fit.
    Raises: InputError: a number of levels is wanted, and the mean scale of one does not rise.
    """
    fields, grids = [field], [grid]
    most, stopped = (MAX_LEVELS if isinstance(wanted, str) else wanted), "no more are wanted"
    for number in range(1, most):
        finer, finer_grid = fields[-1], grids[-1]
        if finer_grid.cells % 2 or (number > 1 and finer_grid.cells // 2 < MIN_CELLS):
            stopped = f"level {number} would be {finer_grid.cells / 2:g} cells wide; tiles make it from their own cells"
            break
        level, coarse = fit_coarser_level(finer, finer_grid, steps, np.random.default_rng([seed, number]))
        rises = mean_scale([level]) > mean_scale([finer])
        if wanted == AUTO and not (rises and len(level) <= MAX_SHARE * len(finer)):
            saved = f"it saves too little ({len(finer)} to {len(level)} Gaussians)"
            wanted, stopped = number, f"level {number}: {saved if rises else 'its mean scale does not rise'}"
            break
        if not rises:
            raise InputError(f"levels: the mean scale does not rise from level {number - 1} to {number}; ask for fewer")
        fields.append(level)
        grids.append(coarse)
    _log.info("%d levels: %s", len(fields), stopped)
    return Levels(fields, grids, wanted, stopped)


def fit_coarser_level(
    field: GaussianField, grid: Ground, steps: int, rng: np.random.Generator
) -> tuple[GaussianField, Ground]:
    """The next level: half the resolution, about a quarter of the Gaussians, fitted for `steps` steps.

    Uncertainty is that of the Gaussians that were merged: the fit to pictures of them learns nothing of the photos.
    """
    start, coarse = halve_resolution(*crop_to_blocks(field, grid, 2))
    views = mask_to_ground(render_neighbour_views(field, coarse), coarse)
    objects = start[~start.ground]
    top = CLEARANCE * coarse.spacing
    if len(objects):
        top += float((objects.means[:, 2] - coarse.height_at(objects.means)).max())
    constraints = GroundConstraints(coarse, np.full(coarse.shape, top), smoothing=None)
    plan = FitPlan(steps, len(start))
    options = trainer.FitOptions(f"fit level of {len(start)} Gaussians")
    fit = trainer.fit_field(start, views, plan, constraints, rng, options)
    level = replace(fit.field, uncertainty=start.uncertainty[fit.kept])
    level = discs.copy_uncertainty(level, coarse)
    scales = mean_scale([field]), mean_scale([level])
    _log.info("mean scale %.4g to %.4g, %d to %d Gaussians", *scales, len(field), len(level))
    return level, coarse


def render_neighbour_views(field: GaussianField, coarse: Ground) -> list[TrainingView]:
    """Render the pictures that a coarser level is fitted to: PIXELS_PER_DISC pixels a coarse disc.

    They are rendered at twice the size and averaged, so that splats finer than a pixel do not alias. Pixels that the
    field hardly covers do not count: over low ground rays pass the field's border before they are below z = 0.
    Colours are those that are shipped of every level, without their view-dependent part: a level that was fitted to
    more would show another colour than the level before it.
    """
    field = replace(field, sh=field.sh[:, :1])
    rasterizer, views = raster.make_rasterizer(), []
    neighbours = _neighbour_cameras(coarse)
    fine = [camera.resized(2 * camera.width, 2 * camera.height) for camera in neighbours]
    renders = rasterizer.forward_each(to_raster_arrays(field), fine)
    for number, (camera, render) in enumerate(zip(neighbours, renders, strict=True)):
        colour = render.colour / np.maximum(render.alpha, 0.5)[..., None]  # without the background
        size = camera.width, camera.height
        image = image_files.shrink_image(np.clip(colour, 0, 1).astype(np.float32), *size)
        covered = image_files.shrink_image(render.alpha[..., None], *size)[..., 0] > COVERED
        views.append(TrainingView(f"neighbour_{number}", camera, image, covered.astype(np.float32)))
    return views


def _neighbour_cameras(grid: Ground) -> list[Camera]:
    rows, columns = grid.shape
    width, height = columns * grid.spacing, rows * grid.spacing
    centre = np.array([grid.west + width / 2, grid.south + height / 2, float(grid.heights.mean())])
    side = int(np.clip(PIXELS_PER_DISC * max(rows, columns), 64, 1024))
    fov = 40.0
    radius = 0.6 * max(width, height) / np.tan(np.radians(fov / 2))
    views = []
    for elevation in ELEVATIONS:
        for step in range(1 if elevation == 90.0 else AZIMUTHS):
            azimuth = np.radians(360 / AZIMUTHS * (step + 0.5 * (elevation < 50)))
            e = np.radians(elevation)
            away = radius * np.array([np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e)])
            views.append(cameras.pinhole(centre + away, centre, side, side, fov))
    return views
