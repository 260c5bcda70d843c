"""Fit windows of the ground at the photos' own resolution, around them the draft field as it is.

Tiles are cut from a few squares of the ground. A fit of all the ground spends its Gaussians on what no tile shows, so
the draft field says where the squares are, and only they are fitted again: each to its part of the photos, with the
draft's Gaussians outside it held fixed behind and before it.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.arrays import blur
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry.scene_frame import SceneFrame, Square
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import WHOLE, TrainingView, one_by_one
from dav_gswt.photos.view_split import find_ground_pixels
from dav_gswt.reconstruction import discs, objects, observation
from dav_gswt.reconstruction.coarse import BLOCK, Reconstruction, finish_field
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitPlan, FitReport, FitSettings
from dav_gswt.reconstruction.fitting.trainer import FitOptions
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.plane_sweep import sweep_heights

_log = logging.getLogger(__name__)

MARGIN = 2.0  # cells of the draft, fitted around a window: its discs reach so far into the window
DRAFT_RELIEF = 3.0  # cells of the draft: its finer relief is noise of its small photos, and heights start without it
SMOOTHING = 1.0  # cells: blur of the gradients of heights, as cells are nearly as narrow as pixels
FINEST = 2.5  # pixels of a photo across a cell at most: finer photos are shrunk, as no cell could show their detail
LEAST_PIXELS = 400  # of a photo over a window, to count as one that shows it


@dataclass(frozen=True)
class Draft:
    """The field that was fitted first, of all the ground, and its grid."""

    field: GaussianField
    grid: Ground
    frame: SceneFrame


@dataclass(frozen=True)
class FitWindow:
    """A square of ground that is fitted. tiled: tiles are cut from it, so its side is a multiple of BLOCK cells."""

    square: Square
    tiled: bool


def widen_exemplar(grid: Ground, square: Square) -> Ground:
    """The grid with the largest exemplar of whole cells in a square: a draft's is a multiple of BLOCK cells."""
    start = np.array([square.south - grid.south, square.west - grid.west])
    row, column = np.maximum(0, np.ceil(start / grid.spacing - 1e-6)).astype(int).tolist()
    last = np.minimum(np.floor((start + square.side) / grid.spacing + 1e-6), grid.shape).astype(int)
    cells = int((last - [row, column]).min())
    return replace(grid, first_row=row, first_column=column, cells=cells) if cells > grid.cells else grid


def measure_pixel_widths(
    points: Float[Array, "n 3"], views: Sequence[TrainingView]
) -> tuple[Float[Array, "n"], Int[Array, "n"]]:
    """Width of a photo's pixel at points of the ground, the median over the photos that see them, and their number.

    NaN where no photo looks. A pixel's width is depth over focal length, across the line of sight.
    """
    widths = []
    for view in views:
        pixel, depth = view.camera.project(points)
        inside = (depth > 0) & (pixel >= 0).all(1) & (pixel < [view.camera.width, view.camera.height]).all(1)
        widths.append(np.where(inside, depth / view.camera.fx, np.nan))
    seen = np.array(widths)
    count = np.isfinite(seen).sum(0)
    median = np.full(len(points), np.nan)
    median[count > 0] = np.nanmedian(seen[:, count > 0], axis=0)
    return median, count


def fit_windows(
    draft: Draft,
    views: list[TrainingView],
    windows: Sequence[FitWindow],
    spacing: float,
    settings: FitSettings,
    rng: np.random.Generator,
) -> list[tuple[FitWindow, Reconstruction]]:
    """Fit each window to the photos that show it, with cells of one width. An object that no photo shows is left out.

    Args:
        views: all photos of the draft at their full size, as `observation.observe` leaves them.
        spacing: width of the ground's cells, world units.
        settings: its steps are for a fit to all of these photos, its Gaussians for all windows together.
    Raises: InputError: no photo shows a window that tiles are cut from.
    """
    grids = [make_grid(draft.grid, window, spacing) for window in windows]
    total = sum(grid.heights.size for grid in grids)
    fitted = []
    for number, (window, grid) in enumerate(zip(windows, grids, strict=True)):
        own = replace(settings, max_gaussians=int(settings.max_gaussians * grid.heights.size / total))
        name, seen = f"fit window {number + 1} of {len(grids)}", crop_views(views, grid)
        if not seen and window.tiled:
            raise InputError("no photo shows the ground that tiles are cut from: take photos of it, or use fewer masks")
        fitted.append((window, _fit_window(draft, grid, views, seen, own, rng, name)) if seen else None)
    return [each for each in fitted if each is not None]


def make_grid(ground: Ground, window: FitWindow, spacing: float) -> Ground:
    """The grid of a window, with the heights of another ground, and a margin as far as that ground goes."""
    square, block = window.square, BLOCK if window.tiled else 1
    cells = max(block, int(square.side / spacing + 1e-6) // block * block)
    inset = 0.5 * (square.side - cells * spacing)
    west, south = square.west + inset, square.south + inset
    reach = MARGIN * ground.spacing
    rows, columns = ground.shape
    room = [
        west - ground.west,
        south - ground.south,
        ground.west + columns * ground.spacing - west - cells * spacing,
        ground.south + rows * ground.spacing - south - cells * spacing,
    ]
    left, below, right, above = (int(np.clip(each, 0, reach) / spacing) for each in room)
    shape = below + cells + above, left + cells + right
    corner = west - left * spacing, south - below * spacing
    grid = Ground(*corner, spacing, below, left, cells, np.zeros(shape), np.zeros(shape, bool))
    rough = replace(ground, heights=blur(ground.heights, DRAFT_RELIEF))
    return replace(grid, heights=rough.height_at(grid.centres).reshape(shape))


def _fit_window(
    draft: Draft,
    grid: Ground,
    views: list[TrainingView],
    seen: list[TrainingView],
    settings: FitSettings,
    rng: np.random.Generator,
    name: str,
) -> Reconstruction:
    """The field of one window, without what surrounds it. views: all photos; seen: their parts that show the window."""
    plan = settings.plan_coarse_fit(len(views))
    around = draft.field[~grid.contains(draft.field.means)]
    relief = sweep_heights(grid, seen, draft.frame.flying_height, grid.spacing / settings.spacing)
    shell = objects.make_shell(relief, seen)
    room = max(0, settings.max_gaussians - grid.heights.size - discs.count_underlay(grid))
    occluders = observation.thin_at_random(shell[grid.contains(shell.means)], room, rng)
    hiding = concatenate_fields([occluders, around[~around.ground]]) if len(around) else occluders
    colour, known = observation.ground_colours(grid, seen, hiding)
    grid = replace(grid, seen=known)
    layer = discs.make_ground_discs(grid, discs.fill_unknown(colour, known))
    around = around.with_harmonics(layer.sh.shape[1])
    start = concatenate_fields([layer, discs.make_underlay(grid, layer), around, occluders])
    said = "%s: %d x %d cells of %.4g %s, %.1f times as wide as a pixel; %d photos"
    width = measure_pixel_widths(grid.centres[:: max(1, grid.heights.size // 100)], views)[0]
    _log.info(said, name, *grid.shape, grid.spacing, draft.frame.unit, grid.spacing / np.nanmedian(width), len(seen))
    constraints = observation.make_constraints(
        grid, relief, occluders, draft.frame, smoothing=SMOOTHING, frozen=len(around)
    )
    steps = max(1, round(plan.steps * len(seen) / max(1, len(views))))
    plan = FitPlan(steps, settings.max_gaussians + len(around), settings.sh_degree)
    fit = trainer.fit_field(start, seen, plan, constraints, rng, FitOptions(name))
    field, grid = finish_field(fit.field, grid, seen)
    first = grid.heights.size + discs.count_underlay(grid)
    field = field[np.r_[0:first, first + len(around) : len(field)]]
    return Reconstruction(field, grid, FitReport(fit.report.steps, len(field)))


def crop_views(views: list[TrainingView], grid: Ground) -> list[TrainingView]:
    """The parts of views that show a window: of those that show LEAST_PIXELS of it, or else of any that show some."""
    masked = observation.mask_for_fit(views, grid)
    many = [view for view in masked if (view.weight > 0).sum() >= LEAST_PIXELS]
    west, south, side = grid.exemplar
    middle = np.array([west + side / 2, south + side / 2, np.median(grid.heights)])
    cropped = [crop_view(view, middle, grid.spacing / FINEST) for view in one_by_one(many or masked)]
    return [view for view in cropped if view is not None]


def crop_view(view: TrainingView, at: Float[Array, "3"], pixel: float) -> TrainingView | None:
    """The part of a view that counts, shrunk where its pixels are finer than `pixel`; None where none counts.

    at: the point of the ground whose pixels are meant. pixel: width on the ground, world units.
    """
    counts = view.weight > 0
    if not counts.any():
        return None
    rows, columns = (np.flatnonzero(counts.any(axis)) for axis in (1, 0))
    box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    camera, image, weight = view.camera, view.image[box], view.weight[box]
    height, width = weight.shape
    camera = replace(camera, cx=camera.cx - columns[0], cy=camera.cy - rows[0], width=width, height=height)
    pixels = {"image": image, "weight": weight}
    if view.behind is not None:
        pixels["behind"] = view.behind[box]
    elif (factor := pixel * camera.fx / camera.project(at[None])[1][0]) > 1:
        width, height = (max(1, round(n / factor)) for n in (width, height))
        camera = camera.resized(width, height)
        pixels["image"] = image_files.shrink_image(image, width, height)
        pixels["weight"] = (image_files.shrink_image(weight[..., None], width, height)[..., 0] > WHOLE) * np.float32(1)
    return replace(view, camera=camera).with_pixels(**{k: np.ascontiguousarray(v) for k, v in pixels.items()})


def mask_to_squares(views: list[TrainingView], squares: Sequence[tuple[float, float, float]]) -> list[TrainingView]:
    """The views, counting where they look at one of these squares of the plane z = 0 (west, south, side)."""
    out = []
    for view in one_by_one(views):
        inside = [find_ground_pixels(view.camera, (w, s, w + side, s + side)) for w, s, side in squares]
        out.append(view.with_pixels(weight=view.weight * np.any(inside, axis=0).astype(np.float32)))
    return out


def join_windows(draft: Draft, fitted: Sequence[Reconstruction]) -> GaussianField:
    """The draft field with its windows as they were fitted."""
    outside = np.ones(len(draft.field), bool)
    parts = []
    for each in fitted:
        parts.append(each.field[find_inside(each.grid, each.field)].with_harmonics(draft.field.sh.shape[1]))
        outside &= ~find_inside(each.grid, draft.field)
    return concatenate_fields([draft.field[outside], *parts])


def find_inside(grid: Ground, field: GaussianField) -> Bool[Array, "n"]:
    """Which Gaussians lie over a grid's exemplar."""
    west, south, side = grid.exemplar
    x, y = field.means[:, 0].astype(float) - west, field.means[:, 1].astype(float) - south
    return (x >= 0) & (y >= 0) & (x < side) & (y < side)
