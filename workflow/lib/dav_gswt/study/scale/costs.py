"""What one cell costs: a fit, a render with its gradients, scores of candidates, or a choice of tiles. Each has its own
process."""

import resource
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry import camera_layouts, cameras
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos import training_views
from dav_gswt.photos.synthetic.scene import FIELD_OF_VIEW
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.fitting.trainer import FitOptions
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.study.scale.photos import photo_name, place_cameras
from dav_gswt.terrain import visibility
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.tiles.layout import EDGES
from dav_gswt.views import scoring

POINTS = 20_000  # of the ground, given to a fit in place of structure from motion's
SIDE = 1024  # pixels of a picture whose Gaussians are counted
REPEATS = 5  # of a render
TILE = 1000, 250, 60, 15  # Gaussians of a tile, level by level
SWITCHES = 4.0, 12.0, 40.0, np.inf  # tile sides at which a level gives way to the next
BUDGET = 400_000  # Gaussians in view, to which level distances are moved
ABOVE = 1.2  # of a field's side: height of the camera that sees all of it


def measure_fit(
    field: GaussianField, frame: SceneFrame, photos: Path | str, count: int, settings: FitSettings, scratch: Path
) -> dict[str, float | int]:
    """Seconds and memory of a first fit to photos of `photos.render_photos`.

    step_seconds: mean over the steps. prepare_seconds: of all before the first step. peak_mb: of the process.
    """
    begin = time.perf_counter()
    cameras = place_cameras(frame, count, settings.size)
    arrays = training_views.open_array_file(cameras, settings.size, scratch)
    paths = [Path(photos) / photo_name(number) for number in range(count)]
    views = [
        training_views.read_training_view(path.name, camera, path, settings.size, arrays)
        for path, camera in zip(paths, cameras, strict=True)
    ]
    read = time.perf_counter()
    rng = np.random.default_rng(0)
    some = field[rng.choice(np.flatnonzero(field.ground), min(POINTS, int(field.ground.sum())), replace=False)]
    start = StartViews(frame, views, some.means.astype(float), some.base_colours.astype(float), ground.MARGIN)
    steps: list[float] = []
    options = FitOptions(callback=lambda step, state: steps.append(time.perf_counter()))
    made = fit_coarse_field(start, settings, rng, options)
    end = time.perf_counter()
    a_step = (steps[-1] - steps[0]) / max(1, len(steps) - 1)
    return {
        "photos": count,
        "megapixels": settings.size**2 / 1e6,
        "gaussians": len(made.field),
        "steps": len(steps),
        "read_seconds": read - begin,
        "prepare_seconds": steps[0] - a_step - read,
        "step_seconds": a_step,
        "seconds": end - begin,
        "peak_mb": peak_memory(),
    }


def measure_render(field: GaussianField, gaussians: int) -> dict[str, float | int]:
    """Seconds of a forward and backward pass over copies of a field side by side, of which the picture shows all."""
    low, high = (np.quantile(field.means[field.ground, :2], share, axis=0) for share in (0, 1))
    side = float((high - low).max())
    rows = int(np.ceil(np.sqrt(gaussians / len(field))))
    shifts = [(side * i, side * j, 0) for i in range(rows) for j in range(rows)]
    copies = concatenate_fields([replace(field, means=field.means + np.array(shift, np.float32)) for shift in shifts])
    copies = copies[np.sort(np.random.default_rng(0).choice(len(copies), gaussians, replace=False))]
    middle = (*(low + side * rows / 2), float(np.median(field.means[field.ground, 2])))
    camera = camera_layouts.orbit(90.0, 0.0, ABOVE * side * rows, middle, SIDE, SIDE, FIELD_OF_VIEW)
    rasterizer, arrays, spent = make_rasterizer(), to_raster_arrays(copies), []
    for _ in range(REPEATS + 1):  # the first one takes the memory
        begin = time.perf_counter()
        seen = rasterizer.forward(**arrays, camera=camera)
        rasterizer.backward(np.ascontiguousarray(seen.colour))
        spent.append(time.perf_counter() - begin)
    return {"gaussians": gaussians, "seconds": float(np.median(spent[1:])), "peak_mb": peak_memory()}


def measure_scores(field: GaussianField, grid: Ground, frame: SceneFrame, count: int) -> dict[str, float | int]:
    """Seconds of scoring so many candidates without a prior."""
    cameras = place_cameras(frame, count, scoring.PHOTO_WIDTH)
    candidates = [(pose_of_camera(f"pose_{i}", camera, frame), camera) for i, camera in enumerate(cameras)]
    shape = cameras[0].height, cameras[0].width
    blank, weight = np.zeros((*shape, 3), np.float32), np.ones(shape, np.float32)
    taken = training_views.TrainingView("photo", cameras[0], blank, weight)
    begin = time.perf_counter()
    scoring.score_poses(field, grid, candidates, [taken], frame)
    return {"candidates": count, "seconds": time.perf_counter() - begin, "peak_mb": peak_memory()}


def measure_view(field: GaussianField, tiles: int) -> dict[str, float | int]:
    """Seconds in which the library chooses tiles and levels of a view of so many tiles, at eye level, 90 degrees wide.

    Terrain of small tiles; what lies in them is not drawn.
    """
    terrain = make_terrain(field, int(np.ceil(np.sqrt(4 * tiles / np.pi))))
    camera = cameras.pinhole((0.3, 0.3, 1.0), (1.3, 1.3, 1.0), 1920, 1080, 90.0)
    spent, seen = [], 0
    for _ in range(REPEATS):
        begin = time.perf_counter()
        cells = visibility.visible_cells(terrain, camera)
        visibility.coarsen_to_budget(terrain, camera, BUDGET, cells)
        spent.append(time.perf_counter() - begin)
        seen = len(cells)
    return {"tiles": seen, "seconds": float(np.median(spent)), "peak_mb": peak_memory()}


def make_terrain(field: GaussianField, reach: int) -> EndlessTerrain:
    """A terrain of tiles of side 1 with a few Gaussians of the field, up to so many tiles away."""
    return EndlessTerrain(
        tiles={(level, tile): field[:count] for level, count in enumerate(TILE) for tile in range(EDGES)},
        side=1.0,
        switches=list(SWITCHES),
        bands=[0.1 * s for s in SWITCHES[:-1]] + [0.0],
        directions=np.zeros((1, 3)),
        tile_orders=[[0]] * EDGES,
        z=(0.0, 0.1),
        overhang=0.1,
        variants=1,
        salt=1,
        near=0.01,
        reach=reach,
    )


def peak_memory() -> float:
    """Most memory that this process has held, in megabytes; pages of files that it has read are in it."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
