"""From the start views to the coarse field, and from a field and new photos to the next one (the paper's UPDATE_GS)."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt import raster
from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.raster import to_raster_arrays
from dav_gswt.reconstruction import discs, distractors, ground, objects, regression_guard, sky, underlay
from dav_gswt.reconstruction.fitting import exposure, trainer
from dav_gswt.reconstruction.fitting.constraints import Anywhere, Rules
from dav_gswt.reconstruction.fitting.photo_colours import median_colours
from dav_gswt.reconstruction.fitting.plan import AUTO, MOST_GAUSSIANS, STEPS_PER_NEW_PHOTO, STEPS_PER_PHOTO, Count, Plan
from dav_gswt.reconstruction.fitting.state import State
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import OnGround
from dav_gswt.reconstruction.opacity_uncertainty import estimate_uncertainty
from dav_gswt.reconstruction.plane_sweep import Relief, sweep

_log = logging.getLogger(__name__)

LEAST_CEILING = 0.05  # flying heights above the surface where things may grow though the sweep saw none
BAND = 0.1  # flying heights within which a point belongs to a ground with things on it
BLOCK = 32  # the exemplar's side is a multiple of it, in cells: six levels halve it five times
GROUND_SHARE = 0.9  # of the cap that the ground may take, its underlay included; things get the rest
AROUND = 12  # neighbours of a point on the map
EXPLAINED = 0.6  # of the points that a height field must explain, or the scene has no ground
HALF_SHARE = 0.3  # of the steps at half the resolution, where no ground gives a start


@dataclass(frozen=True)
class FitSettings:
    """What a fit may spend: an entry of the config's `presets`."""

    size: int  # longer side of the photos, pixels
    spacing: float  # of the discs, in sizes of a photo's pixel on the ground
    max_gaussians: Count
    steps: Count  # of the coarse fit
    steps_per_photo: Count  # of an update, for every new photo
    level_steps: int  # of the fit of a coarser level
    sh_degree: Count = 0
    pose_rate: float = 0.0  # radians a step that cameras may turn
    levels: Count | None = None  # of detail, where not as many as elsewhere


@dataclass(frozen=True)
class Made:
    """A field over its ground, and how it came to be."""

    field: GaussianField
    grid: Ground
    report: dict


def fit(
    frame: SceneFrame,
    views: list[TrainingView],
    points: Float[Array, "n 3"],
    colours: Float[Array, "n 3"],
    quality: FitSettings,
    rng: np.random.Generator,
    keep: Path | str | None = None,
    margin: float = ground.MARGIN,
    watch: Callable[[int, State], None] | None = None,
) -> Made:
    """A field of the ground and the things on it, fitted to the start views.

    points, colours: of structure from motion, from these views alone. margin: ground modelled around the exemplar, as
    a share of its side. keep, watch: see `trainer.fit`. A scene that no height field explains is fitted as free
    Gaussians.
    """
    pixel = min(frame.flying_height / view.camera.fx for view in views)
    grid = ground.lay(frame, points, quality.spacing * pixel, most_discs(quality), BLOCK, margin)
    explained = _explained(grid, points, frame)
    if explained < EXPLAINED:
        _log.warning("a height field explains only %.0f %% of the points: free Gaussians instead", 100 * explained)
        return _without_ground(grid, views, points, colours, quality, rng, keep, watch)
    scene = _look(frame, grid, views, pixel)
    stand = objects.shell(scene.relief, scene.views)
    lone = objects.lone_points(grid, scene.relief, points, colours, BAND * frame.flying_height)
    stand = _some(concatenate_fields([lone, stand]), _most(quality) - grid.heights.size - underlay.count(grid), rng)
    colour, known = _ground_colours(grid, scene.views, stand)
    grid = replace(grid, seen=known)
    layer = discs.ground_discs(grid, discs.filled(colour, known))
    start = concatenate_fields([layer, underlay.beneath(grid, layer), stand])
    _log.info(
        "ground: %d x %d discs of %.4g %s, %.0f %% seen", *grid.shape, grid.spacing, frame.unit, 100 * known.mean()
    )
    _log.info("things: %d Gaussians over %.1f %% of the ground", len(stand), 100 * scene.relief.stands.mean())
    rules = _rules(grid, scene.relief, stand, frame)
    plan = Plan(_steps(quality, views), quality.max_gaussians, quality.sh_degree, pose_rate=quality.pose_rate)
    masked = sky.behind(scene.views, modelled(scene.views, grid))
    fitted = trainer.fit(start, masked, plan, rules, rng, "fit coarse field", keep, watch)
    return _made(fitted, grid, masked)


def refine(
    field: GaussianField,
    grid: Ground,
    frame: SceneFrame,
    before: list[TrainingView],
    new: list[TrainingView],
    quality: FitSettings,
    rng: np.random.Generator,
    keep: Path | None = None,
) -> Made:
    """The field refined with new photos (the paper's UPDATE_GS).

    Ground that only they see is coloured by them; what they show to stand where nothing stood gets its shell; then all
    is fitted on: steps_per_photo for each new one, transparent Gaussians moved to where the errors are, under the cap.
    New photos that contradict the earlier ones change nothing (`bounded`); without any the field is handed on as it is.
    """
    if not new:
        return Made(field, grid, regression_guard.unchanged(field))
    begun = _begun(field, grid, frame, before + new, quality, rng)

    def on(start: GaussianField, plan: Plan) -> trainer.Fitted:
        return trainer.fit(start, begun.views, plan, begun.rules, rng, f"fit {len(new)} new photos", keep)

    n = len(before)
    found = regression_guard.update(
        field, begun.field, begun.views[:n], begun.views[n:], _plan(quality, field, n, len(new)), on
    )
    if not found.taken:
        return Made(field, grid, found.report)
    return replace(_finished(found.field, begun.grid, begun.views), report=found.report)


@dataclass(frozen=True)
class _Begun:
    """What a refinement starts from. views: all photos, counting where they are fitted."""

    field: GaussianField
    grid: Ground
    views: list[TrainingView]
    rules: Rules


def _begun(
    field: GaussianField,
    grid: Ground,
    frame: SceneFrame,
    views: list[TrainingView],
    quality: FitSettings,
    rng: np.random.Generator,
) -> _Begun:
    """The field with what photos show and it lacks; its first Gaussians are the grid's, as before."""
    if not field.ground.any():
        rules = Anywhere(float(np.exp(np.median(field.log_scales))), _extent(field.means))
        return _Begun(field, grid, views, rules)
    scene = _look(frame, grid, views, min(frame.flying_height / view.camera.fx for view in views))
    there = field[grid.heights.size + underlay.count(grid) :]
    stand = _unknown(objects.shell(scene.relief, scene.views), there, scene.relief.grid.spacing)
    stand = _like(_some(stand, _most(quality) - len(field), rng), field)
    _log.info("things: %d Gaussians where nothing stood", len(stand))
    field, there = concatenate_fields([field, stand]), concatenate_fields([there, stand])
    colour, known = _ground_colours(grid, scene.views, there)
    fresh = known & ~grid.seen
    sh = field.sh.copy()
    sh[: known.size, :1][fresh.ravel()] = rgb_to_sh(colour[fresh.ravel()])
    grid = replace(grid, seen=known)
    masked = sky.behind(scene.views, modelled(scene.views, grid))
    return _Begun(replace(field, sh=sh), grid, masked, _rules(grid, scene.relief, there, frame))


def _steps(quality: FitSettings, views: list[TrainingView]) -> int:
    """How many a first fit takes."""
    return STEPS_PER_PHOTO * len(views) if quality.steps == AUTO else quality.steps


def _plan(quality: FitSettings, field: GaussianField, before: int, new: int) -> Plan:
    """What an update may spend: so many steps for each new photo; where "auto", as many Gaussians a photo as the field
    has that was fitted to those before, and the degree of it."""
    each = STEPS_PER_NEW_PHOTO if quality.steps_per_photo == AUTO else quality.steps_per_photo
    most = min(MOST_GAUSSIANS, len(field) * (before + new) // max(1, before))
    degree = field.degree if quality.sh_degree == AUTO else quality.sh_degree
    return Plan(each * new, quality.max_gaussians, degree, pose_rate=quality.pose_rate, most=most)


@dataclass(frozen=True)
class _Scene:
    """What photos say before any fit: their exposure levelled, what moves masked, what stands."""

    views: list[TrainingView]
    relief: Relief


def _look(frame: SceneFrame, grid: Ground, views: list[TrainingView], pixel: float) -> _Scene:
    if frame.kind == "photos":
        views = exposure.levelled(views, _spread(grid))
    relief = sweep(grid, views, frame.flying_height, pixel)
    if frame.kind == "photos":
        open_ground = ~(relief.onto(grid, relief.stands.astype(float)) > 0.1)
        views = distractors.without(views, grid.centres[open_ground.ravel()])
    return _Scene(views, relief)


def _ground_colours(
    grid: Ground, views: list[TrainingView], stand: GaussianField
) -> tuple[Float[Array, "n 3"], Bool[Array, "r c"]]:
    """The ground's median colours, and which cells a photo sees with nothing standing in between."""
    if len(stand):
        drawn = raster.Rasterizer()
        clear = [drawn.forward(**to_raster_arrays(stand), camera=v.camera).alpha < 0.5 for v in views]
        views = [replace(v, weight=v.weight * c) for v, c in zip(views, clear, strict=True)]
    colour, known = median_colours(grid.centres, views)
    return colour, known.reshape(grid.shape)


def _rules(grid: Ground, relief: Relief, stand: GaussianField, frame: SceneFrame) -> OnGround:
    ceiling = np.maximum(objects.ceiling(grid, relief, stand), LEAST_CEILING * frame.flying_height)
    return OnGround(grid, ceiling)


def _without_ground(grid, views, points, colours, quality, rng, keep, watch) -> Made:
    apart = cKDTree(points).query(points, k=min(4, len(points)))[0][:, 1:].mean(1)
    start = objects.blobs(points, colours, np.clip(0.5 * apart, 1e-6, None), logit=0.0)
    if quality.max_gaussians != AUTO:
        start = start[: quality.max_gaussians]
    plan = Plan(_steps(quality, views), quality.max_gaussians, quality.sh_degree, HALF_SHARE, quality.pose_rate)
    rules = Anywhere(float(np.median(apart)), _extent(points))
    return _made(trainer.fit(start, views, plan, rules, rng, "fit free field", keep, watch), grid, views)


def _made(fitted: trainer.Fitted, grid: Ground, views: list[TrainingView]) -> Made:
    return replace(_finished(fitted.field, grid, views), report=vars(fitted.report))


def _finished(fitted: GaussianField, grid: Ground, views: list[TrainingView]) -> Made:
    """A field with its uncertainty, over the surface that its discs have."""
    field = underlay.as_sure(estimate_uncertainty(fitted, views), grid)
    return Made(field, surface_of(field, grid) if field.ground.any() else grid, {})


def _explained(grid: Ground, points: Float[Array, "n 3"], frame: SceneFrame) -> float:
    """Share of the points over the grid that lie near the median height of their neighbours; 1 of too few to tell.

    The surface itself is no judge: between few points it bends to all of them.
    """
    inside = points[grid.contains(points)]
    if len(inside) <= AROUND:
        return 1.0
    near = cKDTree(inside[:, :2]).query(inside[:, :2], k=AROUND + 1)[1][:, 1:]
    apart = np.abs(inside[:, 2] - np.median(inside[near, 2], axis=1))
    return float((apart < BAND * frame.flying_height).mean())


def _unknown(stand: GaussianField, there: GaussianField, near: float) -> GaussianField:
    """Those Gaussians of a shell that stand where there is no thing yet."""
    if not len(there) or not len(stand):
        return stand
    return stand[cKDTree(there.means).query(stand.means)[0] > near]


def most_discs(quality: FitSettings) -> int:
    """How many discs the cap leaves the ground."""
    return int(GROUND_SHARE * _most(quality) / (1 + 1 / underlay.STRIDE**2))


def _most(quality: FitSettings) -> int:
    return MOST_GAUSSIANS if quality.max_gaussians == AUTO else quality.max_gaussians


def _some(part: GaussianField, room: int, rng: np.random.Generator) -> GaussianField:
    """As many as there is room for, drawn at random: what stands gets thinner everywhere, not lost at one end."""
    if len(part) <= room:
        return part
    return part[np.sort(rng.choice(len(part), max(0, room), replace=False))]


def _like(part: GaussianField, field: GaussianField) -> GaussianField:
    """A part with as many colour coefficients as the field has."""
    sh = np.zeros((len(part), *field.sh.shape[1:]), np.float32)
    sh[:, :1] = part.sh[:, :1]
    return replace(part, sh=sh)


def modelled(views: list[TrainingView], grid: Ground) -> list[TrainingView]:
    """The views, counting only where they look at the grid."""
    rows, columns = grid.shape
    inset = 2 * grid.spacing
    east, north = grid.west + columns * grid.spacing, grid.south + rows * grid.spacing
    return [mask_outside_ground(v, grid.west + inset, grid.south + inset, east - inset, north - inset) for v in views]


def surface_of(field: GaussianField, grid: Ground) -> Ground:
    """The grid with the heights that the fit gave its discs."""
    return replace(grid, heights=field.means[: grid.heights.size, 2].reshape(grid.shape).astype(float))


def _extent(points: Float[Array, "n 3"]) -> float:
    return float(np.linalg.norm(np.percentile(points, 95, axis=0) - np.percentile(points, 5, axis=0)))


def _spread(grid: Ground, most: int = 20_000) -> Float[Array, "n 3"]:
    """Some cells' centres, evenly over the grid: enough to fit exposures by."""
    centres = grid.centres
    return centres[:: max(1, len(centres) // most)]
