"""Scoring of candidate poses: how uncertain the field is in what a camera would see there."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32, Float64
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import select_farthest_poses
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.prior import conditions
from dav_gswt.prior.interface import Condition
from dav_gswt.raster import Rasterizer
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.opacity_uncertainty import render_uncertainty
from dav_gswt.reconstruction.top_view import render_top_view
from dav_gswt.views import prior_sampling
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.coverage import DirectionalCoverage, GroundCells
from dav_gswt.views.frozen_scales import FrozenScales
from dav_gswt.views.pose_maps import Part, PoseMaps
from dav_gswt.views.prior_sampling import PriorConfig
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty.backprojection import backproject_maps
from dav_gswt.views.uncertainty.weighting import Quantiles, Scales, normalise

WIDTH = 96  # pixels along the longer side of a picture for scoring
PHOTO_WIDTH = 384  # pixels across a captured photo that conditions a prior, before cropping and shrinking
UNSEEN = 0.99  # uncertainty of a Gaussian from which on no photo so far shows it
SHOWN = 16  # candidates whose maps are written for display


@dataclass(frozen=True)
class ScoringResult:
    """Result of a scoring. gaussians: uncertainty of each Gaussian of the field, in [0, 1]."""

    scores: Scores
    maps: PoseMaps
    frozen: FrozenScales
    gaussians: Float32[Array, "gaussians"]

    def describe(self) -> dict:
        """Summary for scores.json: number of candidates, available terms, and poses by denoising steps."""
        steps, count = np.unique(self.scores.steps, return_counts=True)
        by_steps = {str(s): int(n) for s, n in zip(steps, count, strict=True)}
        return {"candidates": len(self.scores), "terms": list(self.scores.terms), "poses_by_steps": by_steps}


def make_exr_parts(result: ScoringResult, field: GaussianField, grid: Ground) -> dict[str, Part]:
    """Maps for display as parts of an EXR: the ground from above, and candidates spread over the hemisphere."""
    above = render_top_view(replace(field, uncertainty=result.gaussians), grid).uncertainty[::-1]
    names = [result.scores.names[i] for i in select_farthest_poses(result.scores.poses, SHOWN)]
    return {"above": ({"uncertainty": above}, {"camera": "straight above"})} | result.maps.exr_parts(
        result.scores, names
    )


def scoring_camera(camera: Camera) -> Camera:
    """A candidate's camera at the scoring size: its longer side has WIDTH pixels."""
    longer = max(camera.width, camera.height)
    return camera.resized(*(max(1, round(WIDTH * side / longer)) for side in (camera.width, camera.height)))


def score_poses(
    field: GaussianField,
    grid: Ground,
    candidates: Candidates,
    taken: list[TrainingView],
    frame: SceneFrame,
    prior: PriorConfig | None = None,
    frozen: FrozenScales | None = None,
) -> ScoringResult:
    """Score every candidate: opacity and gain in coverage, with a prior also its terms, and maps.

    taken: the photos so far. prior: None for geometric terms only. frozen: of the first round; None in the first round.
    """
    terms, opacity, cells = _score_geometry(field, grid, candidates, [scoring_camera(v.camera) for v in taken])
    steps, w2_sq = np.zeros(len(candidates), int), None
    if prior is not None and candidates:
        condition, masks = build_conditions(field, grid, candidates, taken, frame, prior.model.size)
        sampled, steps = prior_sampling.sample_terms(prior, condition, [pose.name for pose, _ in candidates], masks)
        terms |= {name: values.astype(np.float64) for name, values in sampled.by_name().items()}
        w2_sq = sampled.maps
    poses, names = [pose for pose, _ in candidates], [pose.name for pose, _ in candidates]
    frozen = frozen or _freeze_scales(terms, w2_sq, names)
    scores, maps = Scores(poses, terms, frozen.scales, steps), PoseMaps(names, opacity, w2_sq, cells)
    return ScoringResult(scores, maps, frozen, _gaussian_uncertainty(field, candidates, w2_sq, frozen))


def build_conditions(
    field: GaussianField, grid: Ground, candidates: Candidates, taken: list[TrainingView], frame: SceneFrame, size: int
) -> tuple[Condition, Float32[Array, "n s s"]]:
    """Build the conditions of a prior at the candidates, and masks of pixels that look at the modelled ground (1).

    What no photo shows is left out of the renders: the field there is a smooth guess, which a prior takes as seen.
    """
    known, shown = conditions.prepare_photos(taken, frame, size), field[np.flatnonzero(field.uncertainty < UNSEEN)]
    squares = [conditions.crop_camera(camera).resized(size, size) for _, camera in candidates]
    masks = np.stack([ground_mask(grid, camera) for camera in squares])
    return conditions.build_condition(shown, candidates, known, frame.flying_height, size), masks


def _score_geometry(
    field: GaussianField, grid: Ground, candidates: Candidates, taken: list[Camera]
) -> tuple[dict[str, Float64[Array, "n"]], Float32[Array, "n h w"], Float32[Array, "n cells"]]:
    """Geometric terms, opacity maps, and the pixels that show each cell of the ground: all from one render a candidate.

    opacity: mean of the map over pixels on the modelled ground; 0 if there are none.
    """
    raster, cells = Rasterizer(), GroundCells(field, grid)
    cameras, opacity = [scoring_camera(camera) for _, camera in candidates], np.zeros(len(candidates))
    maps, pixels = [], []
    for i, camera in enumerate(progress(cameras, "score poses")):
        maps.append(render_uncertainty(field, camera, raster))
        pixels.append(cells.count_pixels(raster))
        weight = ground_mask(grid, camera)
        opacity[i] = float((maps[-1] * weight).sum() / max(1.0, weight.sum()))
    seen = cells.gather_views(cameras, pixels)
    coverage = np.array(DirectionalCoverage(cells, cells.view(taken), seen).gains())
    return {"opacity": opacity, "coverage": coverage}, _stack_maps(maps), seen.pixels


def _stack_maps(maps: list[Float32[Array, "_ _"]]) -> Float32[Array, "n h w"]:
    """Maps as one array, with NaN below and beside smaller ones."""
    shape = (0, 1, 1) if not maps else (len(maps), *np.max([m.shape for m in maps], axis=0))
    out = np.full(shape, np.nan, np.float32)  # cameras of the candidates may differ in their size
    for i, m in enumerate(maps):
        out[i, : m.shape[0], : m.shape[1]] = m
    return out


def ground_mask(grid: Ground, camera: Camera) -> Float32[Array, "h w"]:
    """Mask (1) of the pixels that look at the modelled ground."""
    shape = camera.height, camera.width
    blank = TrainingView("", camera, np.zeros((*shape, 3), np.float32), np.ones(shape, np.float32))
    return mask_outside_ground(blank, *grid.judged).weight


def _freeze_scales(
    terms: dict[str, Float64[Array, "n"]], w2_sq: Float32[Array, "n h w"] | None, names: list[str]
) -> FrozenScales:
    pixels = None if w2_sq is None or not w2_sq.size else Quantiles.from_values(w2_sq.ravel())
    return FrozenScales(Scales.from_terms(terms, names), pixels)


def _gaussian_uncertainty(
    field: GaussianField, candidates: Candidates, w2_sq: Float32[Array, "n h w"] | None, frozen: FrozenScales
) -> Float32[Array, "gaussians"]:
    """Uncertainty of each Gaussian from the prior's maps; geometric where no candidate sees it, or without a prior."""
    if w2_sq is None or frozen.pixels is None:
        return field.uncertainty
    cameras = [conditions.crop_camera(camera) for _, camera in candidates]
    backprojected = backproject_maps(field, cameras, normalise(w2_sq, frozen.pixels))
    return np.where(np.isnan(backprojected), field.uncertainty, backprojected).astype(np.float32)
